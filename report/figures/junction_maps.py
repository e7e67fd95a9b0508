"""Maps of the junction: fields on its nodes in true proportions, with outlines of some of them and marks.

Scales are linear, or square roots, so that small values are visible; their labels say so. All sizes of a
sheet are known in advance: a layout engine would draw every label several times to find them, which takes
longer than the picture.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize, PowerNorm
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from report.document.escape import LONGEST_LABEL
from report.document.verdict_colours import FAIL

from . import style
from .node_cells import Array, border, cell_edges, cells_of, grid_of, largest_at_places

Outlines = Sequence[tuple[NDArray[np.bool_], str, str]]  # a mask, its colour, its name in the legend
Marks = dict[str, list[list[float]]]  # places (x, y) by the kind of effect

#: Shapes of the marks; other kinds are crosses. More than MANY of a kind are small dots, which hide nothing.
SHAPES = {"fasteners": "o", "installed_fasteners": "s", "clamps": "^"}
MANY = 60
MARK, CLOSED, LARGER, RIM = "#111111", "#FFFFFF", FAIL, "#444444"
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
    low = min(0.0, *(float(np.nanmin(field, initial=0.0)) for field in values))
    high = max(float(np.nanmax(field, initial=low)) for field in values)
    return Scale(f"{label}\n(√ scale)", colours, PowerNorm(0.5, low, high if high > low else low + 1.0))


def larger_than(limit_mm: float, gap: Array) -> tuple[NDArray[np.bool_], str, str]:
    """The outline of the gaps that are larger than a limit."""
    return gap > limit_mm, LARGER, f"gap of more than {limit_mm:g} mm"


@dataclass(frozen=True)
class Map:
    """A field on `nodes`, with outlines of some of them."""

    title: str
    nodes: Array
    values: Array
    scale: Scale
    outlines: Outlines = ()
    marks: Marks = field(default_factory=dict)


def map_sheet(maps: Sequence[Map], beside: int, corners: Array | None = None) -> tuple[Figure, list[Axes]]:
    """A sheet of maps with a colour bar for each scale, and a legend of the marks. Maps of a wide strip are
    stacked, of an upright one all side by side, of another region `beside` and at most three per row.

    corners : points that every map shows; by default all nodes.
    """
    entries = {
        *(kind for item in maps for kind in item.marks),
        *(o[2] for item in maps for o in item.outlines if o[0].any()),
    }
    scales = list(dict.fromkeys(item.scale for item in maps))
    shown = np.concatenate([item.nodes for item in maps]) if corners is None else corners
    low, high = shown.min(axis=0), shown.max(axis=0)
    size, middle = np.maximum(high - low, THINNEST * (high - low).max() or 1.0), (low + high) / 2
    ratio = size[1] / size[0]
    columns = 1 if ratio < NARROW else len(maps) if ratio > UPRIGHT else min(beside, 3)
    titles = [item.title for item in maps]
    sheet, panels, bars, ncols = _sheet(middle, size, titles, columns, len(entries), len(scales))
    colours: dict[Scale, ScalarMappable] = {}
    named: dict[str, Any] = {}
    for axes, item in zip(panels, maps, strict=True):
        colours[item.scale] = _field(axes, item.nodes, item.values, item.scale)
        for inside, colour, label in item.outlines:
            _outlined(axes, item.nodes, inside, colour, label)
        _marked(axes, item.marks)
        handles, labels = axes.get_legend_handles_labels()
        named |= dict(zip(labels, handles, strict=True))
    for bar, scale in zip(bars, scales, strict=True):
        sheet.colorbar(colours[scale], cax=bar, label=scale.label)
    if named:
        sheet.legend(named.values(), named.keys(), loc="lower left", ncols=ncols)
    return sheet, panels


def _field(axes: Axes, nodes: Array, values: Array, scale: Scale) -> ScalarMappable:
    """Draw a field on the nodes, each in its cell."""
    axes.set_aspect("equal")
    look: dict[str, Any] = {"norm": scale.norm, "cmap": scale.colours}
    nodes, values = largest_at_places(nodes, values)
    if (grid := grid_of(nodes)) is None:
        drawn = PolyCollection(cells_of(nodes), array=values, edgecolors="face", linewidths=0.3, **look)
        axes.add_collection(drawn)
        return drawn
    x, y, place = grid
    cells = np.empty(len(x) * len(y))
    cells[place] = values
    return axes.pcolormesh(cell_edges(x), cell_edges(y), cells.reshape(len(y), len(x)), **look)


def _outlined(axes: Axes, nodes: Array, inside: NDArray[np.bool_], colour: str, label: str) -> None:
    """Draw the border of some contacts, dark-rimmed on any colour."""
    if not inside.any():
        return
    nodes, inside = largest_at_places(nodes, inside)
    look: dict[str, Any] = {"color": colour, "linewidth": 0.9}
    look |= {} if colour == RIM else {"path_effects": [withStroke(linewidth=1.7, foreground=RIM)]}
    axes.add_collection(LineCollection(list(border(cells_of(nodes), inside)), **look))
    axes.plot([], [], label=label, **look)


def _marked(axes: Axes, marks: Marks) -> None:
    """Draw rings with a white rim, which show on any colour and hide nothing; dots if they are many."""
    for kind, points in marks.items():
        x, y = np.array(points).T
        many = len(points) > MANY
        look: dict[str, Any] = {"linestyle": "", "clip_on": False, "markerfacecolor": "none"}
        look |= {"marker": "." if many else SHAPES.get(kind, "x"), "markersize": 3.0 if many else 4.5}
        axes.plot(x, y, markeredgecolor="#FFFFFF90", markeredgewidth=1.2 if many else 1.6, **look)
        look |= {"markeredgecolor": MARK, "markeredgewidth": 0.6 if many else 1.0}
        axes.plot(x, y, label=kind.replace("_", " "), **look)


def _sheet(
    middle: Array, size: Array, titles: list[str], columns: int, marks: int, bars: int
) -> tuple[Figure, list[Axes], list[Axes], int]:
    """A figure with an empty map of one region for each title, row by row, the axes of its colour bars, and
    the columns of its legend. The outer maps have tick labels.

    middle, size : of the region, (x, y), mm. marks : the number of legend entries.
    """
    rows = -(-len(titles) // columns)
    ratio = size[1] / size[0]
    room = (style.WIDTH - LEFT - RIGHT - (columns - 1) * BESIDE) / columns
    width = min(room, TALLEST / ratio)
    height = width * ratio
    over = LETTER * min(max(map(len, titles)), LONGEST_LABEL)  # a title may be wider than its map
    across, down = max(width + BESIDE, over), max(height, LOWEST) + BELOW  # from a map to the next
    wide = LEFT + (columns - 1) * across + max(width + RIGHT, over)
    long = (rows - 1) * down + height
    all_bars = max(long, bars * (SHORTEST + BELOW) - BELOW)
    top = TOP + (all_bars - long) / 2  # the maps in the middle of the bars
    legend_columns = max(int(wide / ENTRY), 1)
    tall = TOP + all_bars + BOTTOM + -(-marks // legend_columns) * LINE
    figure = Figure(figsize=(wide, tall))

    def placed(x: float, bottom: float, width: float, height: float) -> Axes:
        return figure.add_axes((x / wide, bottom / tall, width / wide, height / tall))

    maps = []
    for k, title in enumerate(titles):
        row, column = divmod(k, columns)
        axes = placed(LEFT + column * across, tall - top - row * down - height, width, height)
        (west, south), (east, north) = middle - size / 2, middle + size / 2
        axes.set(xlim=(west, east), ylim=(south, north), xlabel="x, mm", ylabel="y, mm")
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
    right = LEFT + (columns - 1) * across + width + FROM_MAPS
    bar = (all_bars + BELOW) / bars - BELOW
    places = [placed(right, tall - TOP - bar - k * (bar + BELOW), BAR, bar) for k in range(bars)]
    return figure, maps, places, legend_columns
