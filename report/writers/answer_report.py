"""Writes the answer of one scene: Markdown with pictures, CSV files of the nodal results, VTU, a page in HTML
with maps, and a sheet to file.
"""

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from report.document.blocks import Block, Column, Figure, Section, Table, Text, facts_table, number, word
from report.document.numbers import extent, raised, significant, whole
from report.figures.answer_maps import answer_figures
from report.figures.node_cells import grid_of
from report.page.answer_page_data import FASTENER, FORCE, answer_data, facts, headline, stage_table
from report.page.page_file import write as write_page
from report.results.answer_record import (
    closed_contacts,
    contacts,
    fasteners,
    nodes,
    pair_name,
    read,
    stresses,
    von_mises,
)
from report.results.series_results import Array
from report.writers.sections_writer import written
from report.writers.sheet import Sheet, exactness, origin, write_sheet

#: Points, cells and point data for meshio.
MeshData = tuple[Array, list[tuple[str, Any]], dict[str, Array]]

CAPTIONS = {
    "history": "*The largest gap, and the sums of the forces,* at the end of each stage.",
    "stage-gaps": "*The gap at the end of each stage,* on one square-root scale.",
    "section": "*A section through the largest gap*, its height exaggerated: the faces of the parts.",
    "deformed": "*The parts around the largest gap*, not to scale: the first grey, the second coloured by "
    "the gap left.",
    "gap": "*The gap before and after*, on square-root scales; outlined: closed contacts.",
    "stress": "*The stress of the parts*, by von Mises, on a square-root scale; outlined: near a "
    "force at a point, where the moment of a plate has no limit.",
    "forces": "*The contact forces*, on a square-root scale; outlined: closed contacts.",
    "displacement": "*The displacements*, positive from the first part of a contact to the second; hatched: "
    "the rest of a part; thick: a clamped edge.",
}


def write(directory: Path) -> Path:
    """Write answer.md, answer.pdf, index.html and their files into DIRECTORY, from its solution.json and
    solution.npz; returns the path of answer.md.
    """
    record, arrays = read(directory)
    files = {"nodes": nodes(record, arrays)}
    if record["m"]:
        files["contacts"] = contacts(record, arrays)
    check = record.get("allowed_gap") or {}
    if check.get("contacts"):
        files["exceeding"] = files["contacts"].iloc[check["contacts"]]
    if "stress" in arrays:
        files["stress"] = stresses(record, arrays)
    blocks: list[Block] = []
    figures, vtu = {}, "not written: the nodes have no coordinates"
    if "nodes" in arrays:
        figures = answer_figures(record, arrays)
        vtu = write_vtu(directory / "solution.vtu", record, arrays)
        if "stress" in arrays and vtu == "solution.vtu":
            vtu = f"{vtu}, {write_vtu(directory / 'stress.vtu', record, arrays, grid_with_stresses)}"
    drawn = {name: Figure(name, CAPTIONS[name], drawing) for name, drawing in figures.items()}
    history = stage_table(record, arrays)
    if len(history.data):
        blocks.append(history)
    blocks += [
        drawn.pop(name) for name in ("history", "stage-gaps", "gap", "section", "deformed") if name in drawn
    ]
    blocks += [*_fields(record, arrays), *drawn.values()]
    mesh_error = Text(f"{_proven(record)} {record['grid']['said']}.")
    sure: list[Block] = [mesh_error, facts_table("", "*The solve.*", dict(facts(record)))]
    links = ", ".join(f"[{name}.csv]({name}.csv)" for name in files)
    blocks.append(Text(f"Every value: {links}, `solution.npz`. VTU for ParaView: {vtu}."))
    title = str(record["title"])
    write_page(directory / "index.html", title, answer_data(record, arrays))
    sections = [Section("The answer", blocks), Section("How sure it is", sure)]
    digits = f"The matrices were given. {record['digits']}." if record["digits"] else ""
    skipped = "\n".join(f"- {line}" for line in record["skipped"])
    if told := [Text(text) for text in (digits, skipped) if text]:
        sections.append(Section("What was skipped", told))
    verdict = [f"**{headline(record, arrays)['text']}**"]
    verdict += [f"> **Warning.** {sentence}." for sentence in record.get("unusual", ())]
    page = written(directory / "answer.md", title, sections, verdict, files)
    pictures = [directory / f"{name}.png" for name in ("gap", "section") if name in figures]
    tables = [block for block in blocks if isinstance(block, Table) and block.name in ("stages", "fasteners")]
    write_sheet(directory / "answer.pdf", _sheet(record, arrays, pictures, tables))
    return page


def _sheet(
    record: dict[str, Any], arrays: dict[str, Array], pictures: list[Path], tables: list[Table]
) -> Sheet:
    verdict, check = headline(record, arrays), record.get("allowed_gap") or {}
    error, bound = record["judged_error_mm"] or 0.0, record["error_bound_mm"]
    sure = [exactness(check.get("uncertainty_mm", None if bound is None else bound + error))]
    sure += [f"{text}." for text in (record["grid"]["said"], check.get("beyond_scan")) if text]
    about = sure, origin(record), record.get("inputs", {}), pictures, tables, list(record.get("unusual", ()))
    return Sheet(str(record["title"]), verdict["kind"], verdict["text"], *about)


def _proven(record: dict[str, Any]) -> str:
    bound = record["error_bound_mm"]
    text = "No bound on the error could be proven."
    if bound is not None:
        whose = "The reference" if record["judged_error_mm"] is not None else "Every displacement"
        whose += " of the last stage, at the approaches locked before," if "stages" in record else ""
        text = f"{whose} is within **{significant(raised(bound))} mm** of the exact solution (proven bound)."
    if record["qp"]:
        return text
    why = "the scene has no contact"
    if record["m"]:
        closest = significant(record["closest_mm"])
        why = f"without contact no gap is violated, and the closest contact stays {closest} mm open"
    return f"No quadratic program was needed: {why}. {text}"


def _fields(record: dict[str, Any], arrays: dict[str, Array]) -> list[Block]:
    """The forces in the fasteners, and the ranges of the fields in each pair and part."""
    blocks: list[Block] = []
    if len(forces := fasteners(record)):
        blocks.append(Table("fasteners", "*The force in each fastener.*", forces, [*FASTENER, FORCE]))
    pairs = []
    for pair in record["pairs"]:
        here = slice(pair["start"], pair["stop"])
        line = {name: arrays[name][here] for name in ("gap_before", "gap_after", "lam")}
        closed = f"{whole(closed_contacts(line['lam']))} of {len(line['lam'])}"
        pairs.append(line | {"contact": pair_name(pair), "closed": closed, "force_N": line["lam"].sum()})
    if pairs:
        columns = [word("contact", "contact"), _range("gap before, mm", "gap_before")]
        columns += [_range("gap after, mm", "gap_after"), word("closed", "closed")]
        columns.append(number("sum of contact forces, N", "force_N"))
        blocks.append(
            Table("", "*The contacts*, from the smallest to the largest gap.", pd.DataFrame(pairs), columns)
        )
    parts = [
        {"part": part["name"], "x": arrays["x"][part["start"] : part["stop"]]} for part in record["parts"]
    ]
    columns = [word("part", "part"), _range("displacement, mm", "x")]
    return [*blocks, Table("", "*The parts.*", pd.DataFrame(parts), columns)]


def _range(heading: str, name: str) -> Column:
    return Column(heading, lambda row: extent(row[name]))


def write_vtu(
    path: Path, record: dict[str, Any], arrays: dict[str, Any], grid: Callable[..., MeshData] | None = None
) -> str:
    """Write the parts' junction nodes with their fields. Returns the file's name, or why it was not written,
    since meshio is optional. grid : makes points, cells and point data; by default of those nodes.

    Point data: displacement (0, 0, x) in mm, to warp by; part; Aλ, the force with which the node pushes on
    what it touches, N; the smallest gap before and after at its contacts, mm. NaN: not known, or no contact.
    """
    try:
        import meshio
    except ModuleNotFoundError:
        return "not written: meshio is not installed (pip install 'rivetbench[vtu]')"
    meshio.Mesh(*(grid or grid_with_fields)(record, arrays)).write(path)
    return path.name


def grid_with_stresses(record: dict[str, Any], arrays: dict[str, Any]) -> MeshData:
    """Points, cells and point data of the stresses, N/mm²; side as in `PartStress`; not_to_be_read 0 or 1."""
    part, places = arrays["stress_part"], arrays["stress_places"]
    components = dict(zip(("sxx", "syy", "sxy"), arrays["stress"].T, strict=True))
    data = {"part": part.astype(float), **components, "von_mises": von_mises(arrays)}
    data["side"] = arrays["stress_side"].astype(float)
    data["not_to_be_read"] = arrays["stress_near_force"].astype(float)
    starts = np.searchsorted(part, np.arange(len(record["parts"]) + 1))
    blocks = [_cells(places[a:b], int(a)) for a, b in itertools.pairwise(starts) if a < b]
    return np.column_stack([places, np.zeros(len(places))]), blocks, data


def grid_with_fields(record: dict[str, Any], arrays: dict[str, Any]) -> MeshData:
    """Points (n, 3), cells and point data for meshio."""
    nodes, n = arrays["nodes"], len(arrays["nodes"])
    force, initial, remaining = np.zeros(n), np.full(n, np.nan), np.full(n, np.nan)
    columns = np.repeat(np.arange(record["m"]), np.diff(arrays["A_indptr"]))
    np.add.at(force, arrays["A_indices"], arrays["A_data"] * arrays["lam"][columns])
    np.fmin.at(initial, arrays["A_indices"], arrays["gap_before"][columns])
    np.fmin.at(remaining, arrays["A_indices"], arrays["gap_after"][columns])
    part = np.concatenate([np.full(p["stop"] - p["start"], k) for k, p in enumerate(record["parts"])])
    data = {
        "displacement_mm": np.column_stack([np.zeros((n, 2)), arrays["x"]]),
        "part": part.astype(float),
        "contact_force_N": force,
        "gap_before_mm": initial,
        "gap_after_mm": remaining,
    }
    points = np.column_stack([nodes, np.zeros(n)])
    blocks = [_cells(nodes[p["start"] : p["stop"]], p["start"]) for p in record["parts"]]
    return points, blocks, data


def _cells(nodes: Array, start: int) -> tuple[str, Any]:
    """Quadrilaterals if the nodes are a grid, else the nodes themselves."""
    grid = grid_of(nodes)
    if grid is None:
        return "vertex", start + np.arange(len(nodes))[:, None]
    x, y, place = grid
    at = np.empty(len(place), dtype=int)
    at[place] = start + np.arange(len(place))
    rows = at.reshape(len(y), len(x))
    corners = [rows[:-1, :-1], rows[:-1, 1:], rows[1:, 1:], rows[1:, :-1]]
    return "quad", np.column_stack([corner.ravel() for corner in corners])
