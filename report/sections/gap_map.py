"""Gap maps: the gap between the parts before and after, and the contact forces."""

from __future__ import annotations

from typing import Any
from zipfile import BadZipFile

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize, PowerNorm
from numpy.typing import NDArray

from .. import style
from ..blocks import Figure, Section, Text
from ..rows import Results

Array = NDArray[np.float64]


def section(results: Results) -> Section | None:
    for n in reversed(results.sizes):
        scene = results.middle_scene(n)
        try:
            arrays = results.scene_arrays(scene) if scene else None
        except (OSError, ValueError, BadZipFile):
            return Section(
                "The gap before and after", [Text(f"The file of scene {scene} could not be read.")]
            )
        if arrays and arrays.get("contact_nodes") is not None and arrays["contact_nodes"].ndim == 2:
            return Section("The gap before and after", [_figure(str(scene), n, arrays)])
    return None


def _figure(scene: str, n: int, arrays: dict[str, Array]) -> Figure:
    nodes, before, after, lam = (arrays[k] for k in ("contact_nodes", "gap_before", "gap_after", "lam"))
    fasteners = arrays.get("fasteners", np.empty((0, 2)))
    closed = lam > 0
    width, height = np.ptp(nodes, axis=0)
    strip = 7.6 * height / width  # inches
    drawing = style.figure(3 * (max(strip, 0.5) + 0.42) + 0.5)
    panels: list[Axes] = list(drawing.subplots(3, 1, sharex=True, sharey=True))

    widest = float(max(before.max(), after.max(), 0.0))
    gap = Normalize(min(0.0, float(after.min())), widest or 1.0)
    force = PowerNorm(0.5, 0.0, float(lam.max()) or 1.0)
    grid = _grid(nodes)
    for axes, values, norm, colours in (
        (panels[0], before, gap, mpl.colormaps["viridis"]),
        (panels[1], after, gap, mpl.colormaps["viridis"]),
        (panels[2], np.where(closed, lam, np.nan), force, mpl.colormaps["magma_r"]),
    ):
        drawn = _map(axes, nodes, values, grid, norm, colours)
        axes.set(aspect="equal", ylabel="y, mm")
        axes.grid(visible=False)
        if axes is panels[1]:
            drawing.colorbar(drawn, ax=panels[:2], label="gap, mm", aspect=14, pad=0.015, fraction=0.05)
    drawing.colorbar(drawn, ax=panels[2], label="force, N", aspect=6, pad=0.015, fraction=0.05)
    for axes, colour in ((panels[1], "white"), (panels[2], "#444444")):
        if grid:
            axes.add_collection(LineCollection(_outline(grid, closed), colors=colour, linewidths=0.9))
    for axes in panels[:2]:
        axes.plot(*fasteners.T, "o", markersize=3.2, markerfacecolor="none", markeredgecolor=style.VERMILLION)
    panels[0].set_title("gap before")
    panels[1].set_title("gap after")
    panels[2].set_title("contact forces")
    panels[2].set_xlabel("x, mm")
    caption = (
        f"*Scene {scene} (n = {n}): the gap before and after, and the contact forces.* Both gaps share one "
        f"scale; the panels have the strip's true proportions. Outlined: the {closed.sum()} closed contacts"
        + (f"; circles: the {len(fasteners)} fasteners" if len(fasteners) else "")
        + ". The scale of the forces is that of their square roots, so that small ones show."
    )
    return Figure("gap-map", caption, drawing)


Grid = tuple[Array, Array, NDArray[np.intp]]


def _grid(nodes: Array) -> Grid | None:
    """x, y and the place of each node where the nodes are a full tensor grid, else None."""
    x, column = np.unique(np.round(nodes[:, 0], 6), return_inverse=True)
    y, row = np.unique(np.round(nodes[:, 1], 6), return_inverse=True)
    place = row * len(x) + column
    full = len(place) == len(x) * len(y) == len(np.unique(place)) and len(x) > 1 and len(y) > 1
    return (x, y, place) if full else None


def _map(axes: Axes, nodes: Array, values: Array, grid: Grid | None, norm: Normalize, colours: Any) -> Any:
    if grid is None:
        return axes.scatter(nodes[:, 0], nodes[:, 1], c=values, s=4, norm=norm, cmap=colours)
    x, y, place = grid
    field = np.empty(len(x) * len(y))
    field[place] = values
    shape = (len(y), len(x))
    return axes.pcolormesh(x, y, field.reshape(shape), norm=norm, cmap=colours, shading="nearest")


def _outline(grid: Grid, inside: NDArray[np.bool_]) -> list[Array]:
    """The edges between the cells of closed contacts and the rest, as line segments."""
    x, y, place = grid
    field = np.zeros(len(x) * len(y), dtype=bool)
    field[place] = inside
    padded = np.pad(field.reshape(len(y), len(x)), 1)
    xe, ye = _edges(x), _edges(y)
    rows, columns = np.nonzero(padded[1:-1, 1:] != padded[1:-1, :-1])
    upright = [np.array([[xe[c], ye[r]], [xe[c], ye[r + 1]]]) for r, c in zip(rows, columns, strict=True)]
    rows, columns = np.nonzero(padded[1:, 1:-1] != padded[:-1, 1:-1])
    level = [np.array([[xe[c], ye[r]], [xe[c + 1], ye[r]]]) for r, c in zip(rows, columns, strict=True)]
    return upright + level


def _edges(centres: Array) -> Array:
    """The borders of cells around their centres."""
    middle = (centres[1:] + centres[:-1]) / 2
    return np.concatenate([[2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]])
