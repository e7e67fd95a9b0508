"""Maps of answers: gaps, contact forces and displacements of one scene, and the gaps of two."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from report.results.answer_record import Answer, pair_name

from . import style
from .deformed_faces import deformed_figure
from .gap_section import section_figure
from .junction_maps import CLOSED, LARGER, RIM, Array, Map, Scale, drawn, grid_of, rooted


def answer_figures(record: dict[str, Any], arrays: dict[str, Array]) -> dict[str, Figure]:
    with style.applied():
        figures = {"gap": _gap(record, arrays)} if record["m"] else {}
        for name, seen in (("section", section_figure), ("deformed", deformed_figure)):
            if (figure := seen(record, arrays)) is not None:
                figures[name] = figure
        if (arrays["lam"] > 0).any():
            figures["forces"] = _forces(record, arrays)
        return figures | {"displacement": _displacement(record, arrays)}


def _gap(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """Both gaps of each pair, each on a scale of its own, with the closed contacts and those whose gap is
    larger than allowed.
    """
    before, after, allowed = arrays["gap_before"], arrays["gap_after"], record.get("allowed_gap")
    scales = rooted("gap before, mm", "viridis", before), rooted("gap after, mm", "viridis", after)
    maps = []
    for pair in record["pairs"]:
        own = slice(pair["start"], pair["stop"])
        nodes, outlines = arrays["contact_nodes"][own], [(arrays["lam"][own] > 0, CLOSED, "closed contacts")]
        if allowed is not None:
            limit = allowed["allowed_mm"]
            outlines.append((after[own] > limit, LARGER, f"gap of more than {limit:g} mm"))
        name, marks = pair_name(pair), record["marks"]
        maps.append(Map(f"gap before: {name}", nodes, before[own], scales[0], (), marks))
        maps.append(Map(f"gap after: {name}", nodes, after[own], scales[1], outlines, marks))
    return drawn(maps, 2)[0]


def _forces(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    lam, maps = np.nan_to_num(arrays["lam"]), []
    scale = rooted("force, N", "magma_r", lam)
    for pair in record["pairs"]:
        own = slice(pair["start"], pair["stop"])
        nodes, closed = arrays["contact_nodes"][own], lam[own] > 0
        outlines = [(closed, RIM, "closed contacts")]
        title = f"contact forces: {pair_name(pair)}"
        maps.append(Map(title, nodes, np.where(closed, lam[own], np.nan), scale, outlines, record["marks"]))
    return drawn(maps, len(maps))[0]


def _displacement(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """All parts on one scale; the rest of a part is hatched, a thick edge clamped."""
    parts, x = record["parts"], arrays["x"]
    scale = Scale("displacement, mm", "plasma", Normalize(float(x.min()), float(x.max())))
    maps = []
    for part in parts:
        own = slice(part["start"], part["stop"])
        marks = record["marks"] | ({"supports": part["supports"]} if part["supports"] else {})
        maps.append(Map(f"displacement of {part['name']}", arrays["nodes"][own], x[own], scale, (), marks))
    corners = np.array([(x, y) for part in parts for x in part["outline"][:2] for y in part["outline"][2:]])
    figure, panels = drawn(maps, len(parts), corners)
    for axes, part in zip(panels, parts, strict=True):
        west, east, south, north = part["outline"]
        axes.spines[:].set_visible(False)
        edge: dict[str, Any] = {"edgecolor": "#666666", "facecolor": "white", "hatch": "///", "zorder": 0}
        if grid_of(arrays["nodes"][part["start"] : part["stop"]]) is not None:
            axes.add_patch(Rectangle((west, south), east - west, north - south, clip_on=False, **edge))
        for side, y in (("south", south), ("north", north)):
            if side in part["clamped"]:
                axes.plot([west, east], [y, y], color="#222222", lw=3.0, clip_on=False)
    return figure


def gap_maps(answers: list[Answer], names: list[str]) -> dict[str, Figure]:
    """`gaps`, each pair of each of two scenes on one scale, and `difference`, the second minus the first."""
    (first, one), (_, other) = answers
    scale = rooted("gap, mm", "viridis", one["gap_after"], other["gap_after"])
    change = other["gap_after"] - one["gap_after"]
    size = float(abs(change).max()) or 1.0
    both = Scale("change of the gap, mm", "RdBu_r", Normalize(-size, size))
    gaps, changes = [], []
    for pair in first["pairs"]:
        own, text = slice(pair["start"], pair["stop"]), pair_name(pair)
        nodes = one["contact_nodes"][own]
        for name, (record, arrays) in zip(names, answers, strict=True):
            closed = [(arrays["lam"][own] > 0, CLOSED, "closed contacts")]
            values = arrays["gap_after"][own]
            gaps.append(Map(f"{name}: gap, {text}", nodes, values, scale, closed, record["marks"]))
        title = f"{names[1]} minus {names[0]}: {text}"
        changes.append(Map(title, nodes, change[own], both, (), answers[1][0]["marks"]))
    with style.applied():
        return {"gaps": drawn(gaps, 2)[0], "difference": drawn(changes, len(changes))[0]}
