"""Writes the answer of one scene: a page in Markdown, a PNG per field, CSV files of the nodal results, VTU,
and a page in HTML with the maps.

Reads solution.json and solution.npz of a directory, nothing else.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np

from report.document.escape import csv_cell, picture, quoted
from report.figures import style
from report.figures.answer import answer_figures, pair_name
from report.figures.maps import Array
from report.page.answer import answer_data, headline
from report.page.write import write as write_page

from .pages import rendered
from .vtu import write_vtu

Columns = dict[str, list[Any]]
Rows = list[dict[str, Any]]


def write(directory: Path) -> Path:
    """Write answer.md, index.html and their files into DIRECTORY and return the path of answer.md."""
    record = quoted(json.loads((directory / "solution.json").read_text("utf-8")))
    with np.load(directory / "solution.npz") as saved:
        arrays = {name: saved[name] for name in saved.files}
    _write_csv(directory / "nodes.csv", _nodes(record, arrays))
    if record["m"]:
        contacts = _contacts(record, arrays)
        _write_csv(directory / "contacts.csv", contacts)
        if check := record.get("allowed_gap"):
            larger = {name: [column[k] for k in check["contacts"]] for name, column in contacts.items()}
            _write_csv(directory / "exceeding.csv", larger)
    if record.get("fasteners"):
        _write_csv(directory / "fasteners.csv", _fasteners(record["fasteners"]))
    figures = answer_figures(record, arrays) if "nodes" in arrays else {}
    with style.applied():
        for name, drawing in figures.items():
            picture(drawing).savefig(directory / f"{name}.png", dpi=style.DPI)
    vtu = "not written: the nodes have no coordinates"
    if "nodes" in arrays:
        vtu = write_vtu(directory / "solution.vtu", record, arrays)
    path = directory / "answer.md"
    parts, pairs = _summary(record, arrays)
    first = headline(record, arrays)["text"]
    content = {"record": record, "parts": parts, "pairs": pairs, "figures": list(figures), "vtu": vtu}
    page = rendered("solution.md.j2", headline=first, **content)
    path.write_text(page, "utf-8")
    write_page(directory / "index.html", str(record["title"]), answer_data(record, arrays))
    return path


def _nodes(record: dict[str, Any], arrays: dict[str, Array]) -> Columns:
    """One row per node of each part."""
    names = [part["name"] for part in record["parts"] for _ in range(part["start"], part["stop"])]
    columns = {"part": names} | _coordinates(arrays.get("nodes"), record["n"])
    return columns | {"displacement_mm": arrays["x"].tolist()}


def _contacts(record: dict[str, Any], arrays: dict[str, Array]) -> Columns:
    """One row per contact of each pair."""
    names = [pair_name(pair) for pair in record["pairs"] for _ in range(pair["start"], pair["stop"])]
    columns = {"contact": names} | _coordinates(arrays.get("contact_nodes"), record["m"])
    return columns | {
        "gap_before_mm": arrays["gap_before"].tolist(),
        "gap_after_mm": arrays["gap_after"].tolist(),
        "force_N": arrays["lam"].tolist(),
    }


def _fasteners(entries: list[dict[str, Any]]) -> Columns:
    """One row per fastener and contact."""
    return {
        "kind": [entry["kind"] for entry in entries],
        "contact": [pair_name(entry) for entry in entries],
        "x_mm": [entry["x"] for entry in entries],
        "y_mm": [entry["y"] for entry in entries],
        "force_N": [entry["force_N"] for entry in entries],
    }


def _coordinates(nodes: Array | None, size: int) -> Columns:
    if nodes is None:
        return {"index": list(range(size))}
    return {"x_mm": nodes[:, 0].tolist(), "y_mm": nodes[:, 1].tolist()}


def _write_csv(path: Path, columns: Columns) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(map(csv_cell, row) for row in zip(*columns.values(), strict=True))


def _summary(record: dict[str, Any], arrays: dict[str, Array]) -> tuple[Rows, Rows]:
    """The figures of each part and of each pair on the page."""
    parts, pairs = [], []
    for part in record["parts"]:
        x = arrays["x"][part["start"] : part["stop"]]
        parts.append({"name": part["name"], "lowest": x.min(), "highest": x.max()})
    for pair in record["pairs"]:
        own = slice(pair["start"], pair["stop"])
        before, after, force = (arrays[name][own] for name in ("gap_before", "gap_after", "lam"))
        pairs.append(
            {
                "name": pair_name(pair),
                "before": (before.min(), before.max()),
                "after": (after.min(), after.max()),
                "closed": int((force > 0).sum()),
                "of": len(force),
                "force": np.nansum(force),
            }
        )
    return parts, pairs
