"""Lines of time: against the active contacts or the size, with marks for runs without an answer in the
limit.
"""

from __future__ import annotations

from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from harness.results.schema import ANSWERED
from report.results.rows import in_order

from . import style

YARDSTICK: dict[str, Any] = {"color": "#888888", "linewidth": 1.0, "zorder": 0.5}
BESIDE: dict[str, Any] = {
    **{"textcoords": "offset points", "va": "center", "fontsize": 7.5, "color": "#666666"},
    "bbox": {"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 1},
}
OUTSIDE: dict[str, Any] = {
    "marker": "x",
    "markersize": 8,
    "markeredgewidth": 1.8,
    "linestyle": "",
    "zorder": 5,
}
HOLLOW: dict[str, Any] = {"linestyle": "", "markersize": 6, "markerfacecolor": "none", "zorder": 4}
STEP = 0.018  # of the axes: between marks that would coincide
#: What marks mean, for captions.
MARKS = (
    "Crosses on a line: outside {limit}. Open triangles: stopped at the time limit; crosses at the upper "
    "edge: no answer for another reason."
)


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
    for limit in missed.loc[late, "time_limit_s"].unique():
        axes.axhline(limit, **YARDSTICK)
        axes.annotate(f"limit {limit:g} s", (1, limit), (3, 0), xycoords=("axes fraction", "data"), **BESIDE)
    low, high = axes.get_xlim()
    for in_time, runs in missed.groupby(~late):
        mark = "x" if in_time else "^"
        for place, (_, run) in zip(runs.groupby("scene").cumcount(), runs.iterrows(), strict=True):
            at, height = run["active"] + STEP * place * (high - low), 0.97 if in_time else run["time_limit_s"]
            along = axes.get_xaxis_transform() if in_time else axes.transData
            axes.plot([at], [height], mark, color=styles[run["method"]]["color"], transform=along, **HOLLOW)


def entries(cells: pd.DataFrame, styles: dict[str, dict[str, Any]]) -> list[Line2D]:
    """The legend: the methods, and the marks that occur."""
    missed = ~cells["verdict"].isin(ANSWERED)
    late = missed & (cells["status"] == "time_limit")
    marks = [
        (cells["verdict"].isin(ANSWERED[1:]), "not within the limit", OUTSIDE),
        (late, "not finished in time", HOLLOW | {"marker": "^"}),
        (missed & ~late, "no answer", HOLLOW | {"marker": "x"}),
    ]
    known = [
        Line2D([], [], label=text, **(look | {"color": style.GREY}))
        for here, text, look in marks
        if here.any()
    ]
    return [*style.legend_entries(styles), *known]


def yardstick(axes: Axes, heights: pd.Series[float], what: str) -> None:
    """A grey line, by its place along the axis, with its name at its end."""
    axes.plot(heights.index, heights, **YARDSTICK)
    axes.annotate(what, (heights.index[-1], heights.iloc[-1]), (8, 0), **BESIDE)
