"""Maps of the answer of one scene: gaps, contact forces and displacements."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize, PowerNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke

from . import style
from .maps import Array, draw, grid_of, outline
from .sheet import Sheet, sheet

#: Marks on the junction, by the kind of effect.
MARKS = {"fasteners": "o", "installed_fasteners": "s", "clamps": "^"}
THINNEST = 0.02  # a map's shorter side over its longer one
CLOSED, RIM = "#FFFFFF", "#444444"
NARROW, UPRIGHT = 0.5, 2.0  # height over width of a junction: maps stacked, all side by side


def pair_name(pair: dict[str, Any]) -> str:
    return " – ".join(pair["pair"])


def answer_figures(record: dict[str, Any], arrays: dict[str, Array]) -> dict[str, Figure]:
    with style.applied():
        figures = {"gap": _gap(record, arrays)} if record["m"] else {}
        if (arrays["lam"] > 0).any():
            figures["forces"] = _forces(record, arrays)
        return figures | {"displacement": _displacement(record, arrays)}


def _gap(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """Both gaps of each pair, each on a square-root scale of its own; closed contacts are outlined, and in
    red those whose gap is larger than allowed.
    """
    before, after, allowed = arrays["gap_before"], arrays["gap_after"], record.get("allowed_gap")
    titles = [f"gap {when}: {pair_name(pair)}" for pair in record["pairs"] for when in ("before", "after")]
    outlines = 1 + (allowed is not None)
    maps = map_sheet(arrays["contact_nodes"], titles, 2, len(record["marks"]) + outlines, bars=2)
    norms = [PowerNorm(0.5, 0.0, max(float(values.max()), 0.0) or 1.0) for values in (before, after)]
    for k, pair in enumerate(record["pairs"]):
        own = slice(pair["start"], pair["stop"])
        nodes = arrays["contact_nodes"][own]
        drawn = []
        for axes, values, norm in zip(maps.axes[2 * k : 2 * k + 2], (before, after), norms, strict=True):
            drawn.append(draw(axes, nodes, values[own], norm, "viridis"))
            marked(axes, record["marks"])
        outlined(axes, nodes, arrays["lam"][own] > 0, CLOSED, "closed contacts")
        if allowed is not None:
            limit = allowed["allowed_mm"]
            outlined(axes, nodes, after[own] > limit, style.VERMILLION, f"gap of more than {limit:g} mm")
    return maps.finished((drawn[0], "gap before, mm"), (drawn[1], "gap after, mm"))


def _forces(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """The forces on a square-root scale, so that small ones are visible."""
    pairs, lam = record["pairs"], np.nan_to_num(arrays["lam"])
    titles = [f"contact forces: {pair_name(pair)}" for pair in pairs]
    maps = map_sheet(arrays["contact_nodes"], titles, len(pairs), len(record["marks"]) + 1)
    norm = PowerNorm(0.5, 0.0, float(lam.max(initial=0.0)) or 1.0)
    for axes, pair in zip(maps.axes, pairs, strict=True):
        own = slice(pair["start"], pair["stop"])
        nodes, closed = arrays["contact_nodes"][own], lam[own] > 0
        drawn = draw(axes, nodes, np.where(closed, lam[own], np.nan), norm, "magma_r")
        outlined(axes, nodes, closed, RIM, "closed contacts")
        marked(axes, record["marks"])
    return maps.finished((drawn, "force, N"))


def _displacement(record: dict[str, Any], arrays: dict[str, Array]) -> Figure:
    """All parts on one scale; the rest of a part is hatched, a thick edge clamped."""
    parts = record["parts"]
    corners = np.array([(x, y) for part in parts for x in part["outline"][:2] for y in part["outline"][2:]])
    supports = any(part["supports"] for part in parts)
    titles = [f"displacement of {part['name']}" for part in parts]
    maps = map_sheet(corners, titles, len(parts), len(record["marks"]) + supports)
    norm = Normalize(float(arrays["x"].min()), float(arrays["x"].max()))
    for axes, part in zip(maps.axes, parts, strict=True):
        west, east, south, north = part["outline"]
        axes.spines[:].set_visible(False)
        edge: dict[str, Any] = {
            "clip_on": False,
            "edgecolor": "#666666",
            "facecolor": "white",
            "hatch": "///",
        }
        axes.add_patch(Rectangle((west, south), east - west, north - south, **edge))
        own = slice(part["start"], part["stop"])
        drawn = draw(axes, arrays["nodes"][own], arrays["x"][own], norm, "plasma")
        for side, y in (("south", south), ("north", north)):
            if side in part["clamped"]:
                axes.plot([west, east], [y, y], color="#222222", lw=3.0, clip_on=False)
        marked(axes, record["marks"] | ({"supports": part["supports"]} if part["supports"] else {}))
    return maps.finished((drawn, "displacement, mm"))


def map_sheet(nodes: Array, titles: list[str], beside: int, marks: int, bars: int = 1) -> Sheet:
    """Maps of the bounding box of the nodes: stacked if it is a wide strip, all side by side if it is
    upright, else `beside` and at most three per row.
    """
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    thin = THINNEST * (high - low).max() or 1.0
    size, middle = np.maximum(high - low, thin), (low + high) / 2
    ratio = size[1] / size[0]
    columns = 1 if ratio < NARROW else len(titles) if ratio > UPRIGHT else min(beside, 3)
    return sheet(middle - size / 2, middle + size / 2, titles, columns, marks, bars)


def outlined(axes: Axes, nodes: Array, inside: Any, colour: str, label: str) -> None:
    """The border of some contacts, if they lie on a grid, with a dark rim, so that it shows on any colour."""
    grid = grid_of(nodes)
    if grid and inside.any():
        look: dict[str, Any] = {"linewidth": 0.9}
        if colour != RIM:
            look["path_effects"] = [withStroke(linewidth=1.7, foreground=RIM)]
        axes.add_collection(LineCollection(outline(grid, inside), color=colour, **look))
        axes.plot([], [], color=colour, label=label, **look)


def marked(axes: Axes, marks: dict[str, list[list[float]]]) -> None:
    """Rings with a white rim, visible on any colour without hiding what is inside them."""
    for kind, points in marks.items():
        x, y = np.array(points).T
        ring: dict[str, Any] = {"markersize": 4.5, "markerfacecolor": "none", "clip_on": False}
        shape = MARKS.get(kind, "x")
        axes.plot(x, y, shape, markeredgecolor="#FFFFFF90", markeredgewidth=1.6, **ring)
        label = kind.replace("_", " ")
        axes.plot(x, y, shape, markeredgecolor=style.VERMILLION, markeredgewidth=1.0, label=label, **ring)
