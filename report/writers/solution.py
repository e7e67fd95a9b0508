"""Draws the answer of one scene: Markdown of one page, a PNG a field, CSV of the nodal results, VTU.

Reads solution.json and solution.npz of a directory, nothing else.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize, PowerNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from report.document.numbers import significant
from report.figures import style
from report.figures.maps import Array, draw, grid_of, outline
from report.figures.sheet import Sheet, sheet

from .vtu import write_vtu

#: Marks of what stands on the junction, by the kind of the effect.
MARKS = {"fasteners": "o", "installed_fasteners": "s", "clamps": "^"}
THINNEST = 0.02  # a map's shorter side over its longer one
NARROW, UPRIGHT = 0.5, 2.0  # height over width of a junction: maps below one another, all side by side

Columns = dict[str, list[Any]]
Rows = list[dict[str, Any]]


def write(directory: Path) -> Path:
    """Write answer.md and its files into DIRECTORY and return its path."""
    record = json.loads((directory / "solution.json").read_text("utf-8"))
    with np.load(directory / "solution.npz") as saved:
        arrays = {name: saved[name] for name in saved.files}
    _write_csv(directory / "nodes.csv", _nodes(record, arrays))
    if record["m"]:
        _write_csv(directory / "contacts.csv", _contacts(record, arrays))
    figures = _figures(record, arrays) if "nodes" in arrays else {}
    with style.applied():
        for name, drawing in figures.items():
            drawing.savefig(directory / f"{name}.png", dpi=style.DPI)
    vtu = "not written: the nodes have no coordinates"
    if "nodes" in arrays:
        vtu = write_vtu(directory / "solution.vtu", record, arrays)
    loader = jinja2.FileSystemLoader(Path(__file__).parent / "templates")
    environment = jinja2.Environment(
        loader=loader, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters["significant"] = significant
    path = directory / "answer.md"
    template = environment.get_template("solution.md.j2")
    parts, pairs = _summary(record, arrays)
    path.write_text(
        template.render(record=record, parts=parts, pairs=pairs, figures=list(figures), vtu=vtu), "utf-8"
    )
    return path


def _nodes(record: dict[str, Any], arrays: dict[str, Array]) -> Columns:
    """A row a node of each part."""
    names = [part["name"] for part in record["parts"] for _ in range(part["start"], part["stop"])]
    columns = {"part": names} | _coordinates(arrays.get("nodes"), record["n"])
    return columns | {"displacement_mm": arrays["x"].tolist()}


def _contacts(record: dict[str, Any], arrays: dict[str, Array]) -> Columns:
    """A row a contact of each pair."""
    names = [_name(pair) for pair in record["pairs"] for _ in range(pair["start"], pair["stop"])]
    columns = {"contact": names} | _coordinates(arrays.get("contact_nodes"), record["m"])
    return columns | {
        "gap_before_mm": arrays["gap_before"].tolist(),
        "gap_after_mm": arrays["gap_after"].tolist(),
        "force_N": arrays["lam"].tolist(),
    }


def _coordinates(nodes: Array | None, size: int) -> Columns:
    if nodes is None:
        return {"index": list(range(size))}
    return {"x_mm": nodes[:, 0].tolist(), "y_mm": nodes[:, 1].tolist()}


def _write_csv(path: Path, columns: Columns) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))


def _name(pair: dict[str, Any]) -> str:
    return " – ".join(pair["pair"])


def _summary(record: dict[str, Any], arrays: dict[str, Array]) -> tuple[Rows, Rows]:
    """What the page says of each part, and of each pair."""
    parts, pairs = [], []
    for part in record["parts"]:
        x = arrays["x"][part["start"] : part["stop"]]
        parts.append({"name": part["name"], "lowest": x.min(), "highest": x.max()})
    for pair in record["pairs"]:
        own = slice(pair["start"], pair["stop"])
        before, after, force = (arrays[name][own] for name in ("gap_before", "gap_after", "lam"))
        pairs.append(
            {
                "name": _name(pair),
                "before": (before.min(), before.max()),
                "after": (after.min(), after.max()),
                "closed": int((force > 0).sum()),
                "of": len(force),
                "force": np.nansum(force),
            }
        )
    return parts, pairs


def _figures(record: dict[str, Any], arrays: dict[str, Array]) -> dict[str, Figure]:
    with style.applied():
        figures = {"gap": _gap(record, arrays)} if record["m"] else {}
        if (arrays["lam"] > 0).any():
            figures["forces"] = _forces(record, arrays)
        return figures | {"displacement": _displacement(record, arrays)}


def _gap(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """Both gaps of each pair on one scale, that of their square roots; the closed contacts outlined."""
    before, after = arrays["gap_before"], arrays["gap_after"]
    titles = [f"gap {when}: {_name(pair)}" for pair in record["pairs"] for when in ("before", "after")]
    maps = _sheet(arrays["contact_nodes"], titles, 2, len(record["marks"]))
    norm = PowerNorm(0.5, 0.0, max(float(before.max()), float(after.max()), 0.0) or 1.0)
    for k, pair in enumerate(record["pairs"]):
        own = slice(pair["start"], pair["stop"])
        nodes = arrays["contact_nodes"][own]
        for axes, values in zip(maps.axes[2 * k : 2 * k + 2], (before, after), strict=True):
            drawn = draw(axes, nodes, values[own], norm, "viridis")
            _mark(axes, record["marks"])
        _outline(axes, nodes, arrays["lam"][own] > 0, "white")
    return maps.finished(drawn, "gap, mm")


def _forces(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """The forces on a scale of their square roots, so that small ones show."""
    pairs, lam = record["pairs"], np.nan_to_num(arrays["lam"])
    titles = [f"contact forces: {_name(pair)}" for pair in pairs]
    maps = _sheet(arrays["contact_nodes"], titles, len(pairs), len(record["marks"]))
    norm = PowerNorm(0.5, 0.0, float(lam.max(initial=0.0)) or 1.0)
    for axes, pair in zip(maps.axes, pairs, strict=True):
        own = slice(pair["start"], pair["stop"])
        nodes, closed = arrays["contact_nodes"][own], lam[own] > 0
        drawn = draw(axes, nodes, np.where(closed, lam[own], np.nan), norm, "magma_r")
        _outline(axes, nodes, closed, "#444444")
        _mark(axes, record["marks"])
    return maps.finished(drawn, "force, N")


def _displacement(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """All parts on one scale, each inside its outline; a thick edge is clamped."""
    parts = record["parts"]
    corners = np.array([(x, y) for part in parts for x in part["outline"][:2] for y in part["outline"][2:]])
    supports = any(part["supports"] for part in parts)
    titles = [f"displacement of {part['name']}" for part in parts]
    maps = _sheet(corners, titles, len(parts), len(record["marks"]) + supports)
    norm = Normalize(float(arrays["x"].min()), float(arrays["x"].max()))
    for axes, part in zip(maps.axes, parts, strict=True):
        west, east, south, north = part["outline"]
        axes.spines[:].set_visible(False)
        edge: dict[str, Any] = {"clip_on": False, "edgecolor": "#666666", "facecolor": "#F0F0F0"}
        axes.add_patch(Rectangle((west, south), east - west, north - south, **edge))
        own = slice(part["start"], part["stop"])
        drawn = draw(axes, arrays["nodes"][own], arrays["x"][own], norm, "cividis")
        for side, y in (("south", south), ("north", north)):
            if side in part["clamped"]:
                axes.plot([west, east], [y, y], color="#222222", lw=3.0, clip_on=False)
        _mark(axes, record["marks"] | ({"supports": part["supports"]} if part["supports"] else {}))
    return maps.finished(drawn, "displacement, mm")


def _sheet(nodes: Array, titles: list[str], beside: int, marks: int) -> Sheet:
    """Maps of what holds the nodes: below one another where that is a strip, all side by side where it stands
    upright, else `beside` and at most three."""
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    thin = THINNEST * (high - low).max() or 1.0
    size, middle = np.maximum(high - low, thin), (low + high) / 2
    ratio = size[1] / size[0]
    columns = 1 if ratio < NARROW else len(titles) if ratio > UPRIGHT else min(beside, 3)
    return sheet(middle - size / 2, middle + size / 2, titles, columns, marks)


def _outline(axes: Axes, nodes: Array, closed: Any, colour: str) -> None:
    if grid := grid_of(nodes):
        axes.add_collection(LineCollection(outline(grid, closed), colors=colour, linewidths=0.9))


def _mark(axes: Axes, marks: dict[str, list[list[float]]]) -> None:
    """Rings on a white rim, which stands out from any colour; what is inside them shows."""
    for kind, points in marks.items():
        x, y = np.array(points).T
        ring: dict[str, Any] = {"markersize": 4.5, "markerfacecolor": "none", "clip_on": False}
        shape = MARKS.get(kind, "x")
        axes.plot(x, y, shape, markeredgecolor="#FFFFFF90", markeredgewidth=1.6, **ring)
        label = kind.replace("_", " ")
        axes.plot(x, y, shape, markeredgecolor=style.VERMILLION, markeredgewidth=1.0, label=label, **ring)
