"""Lines of time against the active contacts or the size, with marks for runs without an answer within the
limit; and a picture of cells: a row per method, a column per scene, in groups of scenes with a heading.

Groups that are too wide for one strip continue in a further one below.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from harness.results.schema import ANSWERED
from report.results.rows import in_order

from . import style

YARDSTICK: dict[str, Any] = {"color": "#888888", "linewidth": 1.0, "zorder": 0.5}
BESIDE: dict[str, Any] = {
    **{"textcoords": "offset points", "va": "center", "fontsize": 7.5, "color": "#666666"},
    "bbox": {"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 1},
}
OUTSIDE: dict[str, Any] = {"linestyle": "", "marker": "x", "ms": 8, "mew": 1.8, "zorder": 5}
HOLLOW: dict[str, Any] = {"linestyle": "", "markersize": 6, "markerfacecolor": "none", "zorder": 4}
MOST_LIMITS = 3  # lines; if there are more limits, the mark of a run stands at its own
STEP = 0.018  # of the axes: between marks that would coincide
#: The meaning of the marks, for captions.
MARKS = (
    "Crosses on a line: outside {limit}. Open triangles: stopped at the time limit; crosses at the upper "
    "edge: no answer for another reason."
)
GAP = 0.4  # between groups, in columns
FEWEST = 7.0  # columns, the least width of a strip: few cells stay small
ROOM = 446.0  # points for all columns
LETTER, LARGEST = 0.62, 9.0  # width of a letter over its size; the largest size of the type, points
SMALLEST = 6.5  # points: names of columns that would be smaller stand upright
GREY = "#555555"


def styles_of(cells: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """The styles of the methods of some cells, in their order."""
    styles = style.line_styles(cells)
    return {method: styles[method] for method in in_order(cells, "method")}


def against_contacts(axes: Axes, cells: pd.DataFrame, styles: dict[str, dict[str, Any]]) -> None:
    """Seconds per load case of the cells of one size: one line per method, broken where it has no answer."""
    for method, look in styles.items():
        line = cells[cells["method"] == method].sort_values("active")
        axes.plot(line["active"], line["load_case_s"], **look)
        outside = line[line["verdict"] != "within"]
        axes.plot(outside["active"], outside["load_case_s"], color=look["color"], **OUTSIDE)
    axes.set(yscale="log", ylabel="time per load case, s")
    axes.margins(x=0.07, y=0.08)
    _unfinished(axes, cells, styles)
    style.plain_log(axes.yaxis)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    if (m := cells["m"].iloc[0]) > 0:
        style.percent_above(axes, m)


def _unfinished(axes: Axes, cells: pd.DataFrame, styles: dict[str, dict[str, Any]]) -> None:
    """Marks of the runs without an answer; those of one scene stand side by side."""
    missed = cells[~cells["verdict"].isin(ANSWERED)]
    late = (missed["status"] == "time_limit") & missed["time_limit_s"].notna()
    limits = missed.loc[late, "time_limit_s"].unique()
    for limit in limits if len(limits) <= MOST_LIMITS else ():
        axes.axhline(limit, **YARDSTICK)
        axes.annotate(f"limit {limit:g} s", (1, limit), (3, 0), xycoords=("axes fraction", "data"), **BESIDE)
    low, high = axes.get_xlim()
    for in_time, runs in missed.groupby(~late):
        mark = "x" if in_time else "^"
        for place, (_, run) in zip(runs.groupby("scene").cumcount(), runs.iterrows(), strict=True):
            at, height = run["active"] + STEP * place * (high - low), 0.97 if in_time else run["time_limit_s"]
            along = axes.get_xaxis_transform() if in_time else axes.transData
            axes.plot([at], [height], mark, color=styles[run["method"]]["color"], transform=along, **HOLLOW)
    edge, marked = STEP * (high - low), axes.dataLim
    axes.set_xlim(min(low, marked.x0 - edge), max(high, marked.x1 + edge))  # as wide, of one scene as well


def entries(cells: pd.DataFrame, styles: dict[str, dict[str, Any]]) -> list[Line2D]:
    """The legend: the methods, and the marks that occur."""
    missed = ~cells["verdict"].isin(ANSWERED)
    late = missed & (cells["status"] == "time_limit")
    marks = [
        (cells["verdict"].isin(ANSWERED[1:]), "not within the limit", OUTSIDE),
        (late, "not finished in time", HOLLOW | {"marker": "^"}),
        (missed & ~late, "no answer", HOLLOW | {"marker": "x"}),
    ]
    looks = {text: look | {"color": style.GREY} for here, text, look in marks if here.any()}
    return style.legend_entries(styles | looks)


def yardstick(axes: Axes, heights: pd.Series[float], what: str) -> None:
    """Draw a grey line of heights by their place along the axis, with its name at its end."""
    axes.plot(heights.index, heights, **YARDSTICK)
    axes.annotate(what, (heights.index[-1], heights.iloc[-1]), (8, 0), **BESIDE)


@dataclass(frozen=True)
class Cell:
    text: str
    face: str
    ink: str = GREY
    hatch: str = ""


@dataclass(frozen=True)
class Group:
    """Scenes side by side. columns : names by scene. about : their explanation, below the title."""

    title: str
    columns: dict[str, str]
    about: str = ""


def grid(
    rows: Mapping[str, str],
    groups: Sequence[Group],
    cells: Mapping[tuple[str, str], Cell],
    height: float,
    widest: float,
) -> Figure:
    """A picture of cells. rows : the names of the methods, in order; those without a cell in a strip are left
    out of it.

    cells : by method and scene. height : of a row, in inches. widest : the most columns of a strip.
    """
    size = min(LARGEST, LETTER * 72 * height)
    total = sum(len(group.columns) + GAP for group in groups)
    room = ROOM / max(FEWEST, min(total, widest))  # points for a column
    strips: list[list[tuple[Group, float]]] = [[]]  # with the middle of each group
    right = 0.0
    for group in groups:
        width = max(len(group.columns), LETTER * size * len(group.title) / room)
        if right + width > widest and strips[-1]:
            strips.append([])
            right = 0.0
        strips[-1].append((group, right + width / 2))
        right += width + GAP
    shown = [{scene for group, _ in strip for scene in group.columns} for strip in strips]
    lines = [[row for row in rows if any((row, scene) in cells for scene in of)] for of in shown]
    longest = max((len(name) for group in groups for name in group.columns.values()), default=0) or 1
    upright = room < LETTER * SMALLEST * longest
    tick = min(size, room if upright else room / (LETTER * longest))
    above = size * (1.4 + any(group.about for group in groups))
    names = LETTER * tick * longest if upright else tick
    heights = [height * len(of) + (above + names + 16) / 72 for of in lines]
    drawing = style.figure(sum(heights) + 0.1)
    panels = drawing.subplots(len(strips), 1, height_ratios=heights, squeeze=False)[:, 0]
    width = max(FEWEST, *(middle + len(group.columns) / 2 for strip in strips for group, middle in strip))
    for axes, strip, of_strip in zip(panels, strips, lines, strict=True):
        ticks: dict[float, str] = {}
        for group, middle in strip:
            west = middle - len(group.columns) / 2 + 0.5
            for x, (scene, name) in enumerate(group.columns.items()):
                ticks[west + x] = name
                for y, row in enumerate(of_strip):
                    if (row, scene) in cells:
                        _draw(axes, (west + x, y), cells[row, scene], min(size, LARGEST - 0.5), room)
            _heading(axes, group, middle, size)
        axes.set(xlim=(-0.1, width + 0.1), ylim=(len(of_strip) - 0.5, -0.5))
        axes.set_xticks([*ticks], [*ticks.values()], fontsize=tick, rotation=90 if upright else 0)
        axes.set_yticks(range(len(of_strip)), [rows[row] for row in of_strip], fontsize=size)
        axes.tick_params(length=0)
        axes.grid(visible=False)
        axes.spines[:].set_visible(False)
    return drawing


def _draw(axes: Axes, at: tuple[float, float], cell: Cell, size: float, room: float) -> None:
    x, y = at
    look: Any = {"facecolor": cell.face, "hatch": cell.hatch, "edgecolor": "#AAAAAA"}
    axes.add_patch(Rectangle((x - 0.47, y - 0.45), 0.94, 0.9, linewidth=0.4, **look))
    box = {"facecolor": "white", "pad": 0.5, "linewidth": 0} if cell.hatch else None
    size = min(size, room / (LETTER * max(len(cell.text), 1)))
    place: Any = {"ha": "center", "va": "center_baseline", "in_layout": False}
    axes.text(x, y, cell.text, fontsize=size, color=cell.ink, bbox=box, **place)


def _heading(axes: Axes, group: Group, middle: float, size: float) -> None:
    at: Any = {"xycoords": axes.get_xaxis_transform(), "textcoords": "offset points"}
    at |= {"annotation_clip": False, "ha": "center", "fontsize": size}
    axes.annotate(group.about, (middle, 1), (0, 3), **at)
    axes.annotate(group.title, (middle, 1), (0, 3 + size * bool(group.about)), weight="bold", **at)
