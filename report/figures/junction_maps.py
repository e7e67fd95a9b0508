"""Maps of the junction: fields on its nodes in true proportions, with outlines of some of them and marks.

Scales are linear, or those of the square root, so that small values are visible; their labels say so. All
sizes of a sheet are known in advance: a layout engine would find them by drawing every label several times,
which takes longer than the picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize, PowerNorm
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from report.document.escape import LONGEST_LABEL

from . import style

Array = NDArray[np.float64]
Grid = tuple[Array, Array, NDArray[np.intp]]
Marks = dict[str, list[list[float]]]  # places (x, y) by the kind of effect

#: Shapes of the marks; other kinds are crosses. More than MANY of a kind are small dots, which hide nothing.
SHAPES = {"fasteners": "o", "installed_fasteners": "s", "clamps": "^"}
MANY = 60
MARK, CLOSED, LARGER, RIM = "#111111", "#FFFFFF", "#E8112D", "#444444"
DOTS, DOT, RING = 4000.0, (4.0, 40.0), 8.0  # points² of all dots of a map, of one; points of a ring around it
THINNEST = 0.02  # a map's shorter side over its longer one
NARROW, UPRIGHT = 0.5, 2.0  # height over width of a junction: maps stacked, all side by side
# inches
LEFT, RIGHT, TOP, BOTTOM = 0.85, 1.45, 0.35, 0.5
BESIDE, BELOW = 0.5, 0.4  # between maps; the title of the next one is below a map
NAME_LEFT, NAME_BELOW = 0.6, 0.27  # of an axis, from the map
LOWEST, TALLEST = 0.4, 5.5  # of a row, which has room for "y, mm"; of a map
LETTER = 0.09  # of a title, an upper bound on average
ENTRY, LINE = 1.7, 0.22  # of a legend
BAR, FROM_MAPS, SHORTEST = 0.18, 0.25, 1.0  # of a colour bar: width, distance, least height


@dataclass(frozen=True, eq=False)
class Scale:
    label: str
    colours: str
    norm: Normalize


def rooted(label: str, colours: str, *values: Array) -> Scale:
    """The scale of the square root from 0, or the least value if negative, to the largest."""
    low = min(0.0, *(float(np.nanmin(each, initial=0.0)) for each in values))
    high = max(float(np.nanmax(each, initial=low)) for each in values)
    return Scale(f"{label}\n(√ scale)", colours, PowerNorm(0.5, low, high if high > low else low + 1.0))


@dataclass(frozen=True)
class Map:
    """A field on `nodes`. outlines : which nodes, in what colour, and what they are."""

    title: str
    nodes: Array
    values: Array
    scale: Scale
    outlines: Sequence[tuple[NDArray[np.bool_], str, str]] = ()
    marks: Marks = field(default_factory=dict)


def drawn(maps: Sequence[Map], beside: int, corners: Array | None = None) -> tuple[Figure, list[Axes]]:
    """A sheet of maps, `beside` of them in a row, with a colour bar for each scale. corners : points that
    every map shows; by default all nodes.
    """
    entries = {
        *(kind for each in maps for kind in each.marks),
        *(o[2] for each in maps for o in each.outlines),
    }
    scales = list(dict.fromkeys(each.scale for each in maps))
    shown = np.concatenate([each.nodes for each in maps]) if corners is None else corners
    page = _sheet(shown, [each.title for each in maps], beside, len(entries), len(scales))
    found: dict[Scale, ScalarMappable] = {}
    for axes, each in zip(page.axes, maps, strict=True):
        found[each.scale] = draw(axes, each.nodes, each.values, each.scale)
        for inside, colour, label in each.outlines:
            _outlined(axes, each.nodes, inside, colour, label)
        _marked(axes, each.marks)
    return page.finished(*((found[scale], scale.label) for scale in scales)), page.axes


def _sheet(nodes: Array, titles: list[str], beside: int, marks: int, bars: int) -> Sheet:
    """Maps of the bounding box of the nodes: stacked if it is a wide strip, all side by side if it is
    upright, else `beside` and at most three per row.
    """
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    thin = THINNEST * (high - low).max() or 1.0
    size, middle = np.maximum(high - low, thin), (low + high) / 2
    ratio = size[1] / size[0]
    columns = 1 if ratio < NARROW else len(titles) if ratio > UPRIGHT else min(beside, 3)
    return sheet(middle - size / 2, middle + size / 2, titles, columns, marks, bars)


def grid_of(nodes: Array) -> Grid | None:
    """x, y and the place of each node if the nodes are a full tensor grid, else None."""
    x, column = np.unique(np.round(nodes[:, 0], 6), return_inverse=True)
    y, row = np.unique(np.round(nodes[:, 1], 6), return_inverse=True)
    place = row * len(x) + column
    full = len(place) == len(x) * len(y) == len(np.unique(place)) and len(x) > 1 and len(y) > 1
    return (x, y, place) if full else None


def draw(axes: Axes, nodes: Array, values: Array, scale: Scale) -> ScalarMappable:
    """A field on the nodes: cells if they are a grid, otherwise dots."""
    axes.set(aspect="equal", ylabel="y, mm")
    axes.grid(visible=False)
    look: dict[str, Any] = {"norm": scale.norm, "cmap": scale.colours}
    grid = grid_of(nodes)
    if grid is None:
        size = float(np.clip(DOTS / max(len(nodes), 1), *DOT))
        return axes.scatter(nodes[:, 0], nodes[:, 1], c=values, s=size, **look)
    x, y, place = grid
    cells = np.empty(len(x) * len(y))
    cells[place] = values
    return axes.pcolormesh(_edges(x), _edges(y), cells.reshape(len(y), len(x)), **look)


def _outlined(axes: Axes, nodes: Array, inside: NDArray[np.bool_], colour: str, label: str) -> None:
    """The border of some contacts, or a ring around each off a grid, dark-rimmed to show on any colour."""
    grid = grid_of(nodes)
    if grid is None and inside.any():
        ring: dict[str, Any] = {"marker": "o", "markersize": RING, "linestyle": "", "markerfacecolor": "none"}
        if colour != RIM:
            ring["path_effects"] = [withStroke(linewidth=1.7, foreground=RIM)]
        axes.plot(*nodes[inside].T, markeredgecolor=colour, markeredgewidth=0.9, label=label, **ring)
    if grid and inside.any():
        look: dict[str, Any] = {"linewidth": 0.9}
        if colour != RIM:
            look["path_effects"] = [withStroke(linewidth=1.7, foreground=RIM)]
        axes.add_collection(LineCollection(outline(grid, inside), color=colour, **look))
        axes.plot([], [], color=colour, label=label, **look)


def _marked(axes: Axes, marks: Marks) -> None:
    """Rings with a white rim, visible on any colour without hiding what is inside them; dots if they are
    many.
    """
    for kind, points in marks.items():
        x, y = np.array(points).T
        many = len(points) > MANY
        look: dict[str, Any] = {"linestyle": "", "clip_on": False, "markerfacecolor": "none"}
        look |= {"marker": "." if many else SHAPES.get(kind, "x"), "markersize": 3.0 if many else 4.5}
        axes.plot(x, y, markeredgecolor="#FFFFFF90", markeredgewidth=1.2 if many else 1.6, **look)
        width = 0.6 if many else 1.0
        axes.plot(x, y, markeredgecolor=MARK, markeredgewidth=width, label=kind.replace("_", " "), **look)


def outline(grid: Grid, inside: NDArray[np.bool_]) -> list[Array]:
    """The edges between the cells of closed contacts and the rest, as line segments."""
    x, y, place = grid
    cells = np.zeros(len(x) * len(y), dtype=bool)
    cells[place] = inside
    padded = np.pad(cells.reshape(len(y), len(x)), 1)
    xe, ye = _edges(x), _edges(y)
    rows, columns = np.nonzero(padded[1:-1, 1:] != padded[1:-1, :-1])
    upright = [np.array([[xe[c], ye[r]], [xe[c], ye[r + 1]]]) for r, c in zip(rows, columns, strict=True)]
    rows, columns = np.nonzero(padded[1:, 1:-1] != padded[:-1, 1:-1])
    level = [np.array([[xe[c], ye[r]], [xe[c + 1], ye[r]]]) for r, c in zip(rows, columns, strict=True)]
    return upright + level


def _edges(nodes: Array) -> Array:
    """The borders of the nodes' cells: half-way between the nodes, and the ends of the grid."""
    return np.concatenate([nodes[:1], (nodes[1:] + nodes[:-1]) / 2, nodes[-1:]])


@dataclass(frozen=True)
class Sheet:
    figure: Figure
    axes: list[Axes]
    bars: list[Axes]
    legend_columns: int

    def finished(self, *scales: tuple[ScalarMappable, str]) -> Figure:
        """The sheet with a labelled colour bar for each scale, and a legend of the labelled marks."""
        for bar, (drawn, label) in zip(self.bars, scales, strict=True):
            self.figure.colorbar(drawn, cax=bar, label=label)
        found = [axes.get_legend_handles_labels() for axes in self.axes]
        named = {text: mark for marks, texts in found for mark, text in zip(marks, texts, strict=True)}
        if named:
            self.figure.legend(named.values(), named.keys(), loc="lower left", ncols=self.legend_columns)
        return self.figure


def sheet(low: Array, high: Array, titles: list[str], columns: int, marks: int, bars: int = 1) -> Sheet:
    """An empty map of one region for each title, row by row; the outer ones have tick labels.

    low, high : the region's corners (x, y), mm. marks : the number of legend entries. bars : of scales.
    """
    rows, beside = -(-len(titles) // columns), bars * RIGHT
    ratio = (high[1] - low[1]) / (high[0] - low[0])
    room = (style.WIDTH - LEFT - beside - (columns - 1) * BESIDE) / columns
    width = min(room, TALLEST / ratio)
    height = width * ratio
    over = LETTER * min(max(map(len, titles)), LONGEST_LABEL)  # a title may be wider than its map
    across, down = max(width + BESIDE, over), max(height, LOWEST) + BELOW  # from a map to the next
    wide = LEFT + (columns - 1) * across + max(width + beside, over)
    long = (rows - 1) * down + height
    bar = max(long, SHORTEST)
    top = TOP + (bar - long) / 2  # the maps in the middle of the bar
    legend_columns = max(int(wide / ENTRY), 1)
    tall = TOP + bar + BOTTOM + -(-marks // legend_columns) * LINE
    figure = Figure(figsize=(wide, tall))

    def placed(left: float, bottom: float, width: float, height: float) -> Axes:
        return figure.add_axes((left / wide, bottom / tall, width / wide, height / tall))

    maps = []
    for k, title in enumerate(titles):
        row, column = divmod(k, columns)
        axes = placed(LEFT + column * across, tall - top - row * down - height, width, height)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x, mm", ylabel="y, mm")
        axes.set_title(title, y=1.0)  # a given place spares a search for it
        axes.xaxis.set_label_coords(0.5, -NAME_BELOW / height)
        axes.yaxis.set_label_coords(-NAME_LEFT / width, 0.5)
        axes.grid(visible=False)
        axes.spines[:].set_visible(True)
        first, last = column == 0, k + columns >= len(titles)
        axes.tick_params(left=first, labelleft=first, bottom=last, labelbottom=last)
        axes.yaxis.label.set_visible(first)
        axes.xaxis.label.set_visible(last)
        maps.append(axes)
    right = LEFT + (columns - 1) * across + width
    lefts = [right + FROM_MAPS + k * RIGHT for k in range(bars)]
    return Sheet(figure, maps, [placed(left, tall - TOP - bar, BAR, bar) for left in lefts], legend_columns)
