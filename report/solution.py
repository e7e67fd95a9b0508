"""Draws the answer of one scene: Markdown of one page, a PNG a field, CSV of the nodal results, VTU.

Reads solution.json and solution.npz of a directory, nothing else.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any, Literal

import jinja2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize, PowerNorm
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from . import style
from .maps import Array, draw, grid_of, outline
from .numbers import significant
from .vtu import write_vtu

#: Marks of what stands on the junction, by the kind of the effect.
MARKS = {"fasteners": "o", "installed_fasteners": "s", "clamps": "^"}
STRIP, TALLEST = 7.4, 5.5  # inches: the width of a map over the whole page, the largest height of one
MARGIN = 0.12  # inches
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
            _save(drawing, directory / f"{name}.png")
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


def _save(drawing: Figure, path: Path) -> None:
    """Lay out once and draw once; savefig by itself would draw twice.

    Titles overhang narrow maps, which "tight" takes in. Elsewhere the layout is at most a little off, where
    the maps' proportions leave it no room: a margin is enough.
    """
    width, height = drawing.get_size_inches()
    bounds: Bbox | Literal["tight"] = "tight"
    if (engine := drawing.get_layout_engine()) and width >= style.WIDTH:
        drawing.set_dpi(style.DPI)
        engine.execute(drawing)
        drawing.set_layout_engine(None)
        bounds = Bbox([[-MARGIN, -MARGIN], [width + MARGIN, height + MARGIN]])
    drawing.savefig(path, dpi=style.DPI, bbox_inches=bounds)


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
    pairs = record["pairs"]
    drawing, panels = _panels(arrays["contact_nodes"], 2 * len(pairs), after_each_other=2)
    norm = PowerNorm(0.5, 0.0, max(float(before.max()), float(after.max()), 0.0) or 1.0)
    for k, pair in enumerate(pairs):
        own = slice(pair["start"], pair["stop"])
        nodes = arrays["contact_nodes"][own]
        for axes, values, when in ((panels[2 * k], before, "before"), (panels[2 * k + 1], after, "after")):
            drawn = draw(axes, nodes, values[own], norm, "viridis")
            axes.set_title(f"gap {when}: {_name(pair)}")
            _mark(axes, record["marks"])
        _outline(panels[2 * k + 1], nodes, arrays["lam"][own] > 0, "white")
    drawing.colorbar(drawn, ax=panels, label="gap, mm", pad=0.015, fraction=0.05)
    return _labelled(drawing, panels)


def _forces(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """The forces on a scale of their square roots, so that small ones show."""
    pairs, lam = record["pairs"], np.nan_to_num(arrays["lam"])
    drawing, panels = _panels(arrays["contact_nodes"], len(pairs))
    norm = PowerNorm(0.5, 0.0, float(lam.max(initial=0.0)) or 1.0)
    for axes, pair in zip(panels, pairs, strict=True):
        own = slice(pair["start"], pair["stop"])
        nodes, closed = arrays["contact_nodes"][own], lam[own] > 0
        drawn = draw(axes, nodes, np.where(closed, lam[own], np.nan), norm, "magma_r")
        axes.set_title(f"contact forces: {_name(pair)}")
        _outline(axes, nodes, closed, "#444444")
        _mark(axes, record["marks"])
    drawing.colorbar(drawn, ax=panels, label="force, N", pad=0.015, fraction=0.05)
    return _labelled(drawing, panels)


def _displacement(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """All parts on one scale, each inside its outline; a thick edge is clamped."""
    parts = record["parts"]
    corners = [(x, y) for part in parts for x in part["outline"][:2] for y in part["outline"][2:]]
    drawing, panels = _panels(np.array(corners), len(parts))
    norm = Normalize(float(arrays["x"].min()), float(arrays["x"].max()))
    for axes, part in zip(panels, parts, strict=True):
        own = slice(part["start"], part["stop"])
        drawn = draw(axes, arrays["nodes"][own], arrays["x"][own], norm, "cividis")
        axes.set_title(f"displacement of {part['name']}")
        west, east, south, north = part["outline"]
        axes.plot(
            [west, east, east, west, west], [south, south, north, north, south], color="#666666", lw=0.8
        )
        for edge, y in (("south", south), ("north", north)):
            if edge in part["clamped"]:
                axes.plot([west, east], [y, y], color="#222222", lw=3.0, clip_on=False)
        _mark(axes, record["marks"] | ({"supports": part["supports"]} if part["supports"] else {}))
    drawing.colorbar(drawn, ax=panels, label="displacement, mm", pad=0.015, fraction=0.05)
    return _labelled(drawing, panels)


def _panels(nodes: Array, count: int, after_each_other: int = 1) -> tuple[Figure, list[Axes]]:
    """Maps of one size: below one another where the junction is a strip, else side by side."""
    width, height = np.ptp(nodes, axis=0)
    ratio = float(height / width) if width else 1.0
    columns = 1 if ratio < NARROW else count if ratio > UPRIGHT else min(count, max(2, after_each_other))
    rows = -(-count // columns)
    tall = min(STRIP / columns * ratio, TALLEST)
    drawing = style.figure(rows * (max(tall, 0.5) + 0.45) + 0.6)
    panels = list(drawing.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel())
    if ratio > UPRIGHT:
        drawing.set_figwidth(1.0 + columns * (TALLEST / ratio + 2.0))
    for spare in panels[count:]:
        spare.remove()
    return drawing, panels[:count]


def _outline(axes: Axes, nodes: Array, closed: Any, colour: str) -> None:
    if grid := grid_of(nodes):
        axes.add_collection(LineCollection(outline(grid, closed), colors=colour, linewidths=0.9))


def _mark(axes: Axes, marks: dict[str, list[list[float]]]) -> None:
    for kind, points in marks.items():
        axes.plot(
            *np.array(points).T,
            MARKS.get(kind, "x"),
            markersize=4.5,
            markerfacecolor="none",
            markeredgecolor=style.VERMILLION,
            label=kind.replace("_", " "),
            clip_on=False,
        )


def _labelled(drawing: Figure, panels: list[Axes]) -> Figure:
    panels[-1].set_xlabel("x, mm")
    for axes in panels:
        axes.label_outer()
    found = [axes.get_legend_handles_labels() for axes in panels]
    named = {
        label: handle for handles, labels in found for handle, label in zip(handles, labels, strict=True)
    }
    if named:
        drawing.legend(named.values(), named.keys(), loc="outside lower left", ncols=len(named))
    return drawing
