"""Seconds per load case against the active contacts, at one size."""

from __future__ import annotations

from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from harness.results.schema import ANSWERED

from . import style, unfinished

OUTSIDE: dict[str, Any] = {
    "marker": "x",
    "markersize": 8,
    "markeredgewidth": 1.8,
    "linestyle": "",
    "zorder": 5,
    "path_effects": [withStroke(linewidth=4, foreground="white")],
}
#: The meaning of the marks of `panel`, for captions.
MARKS = (
    "Crosses on a line, in its colour: an answer outside {limit}. Open triangles: runs that did not finish, "
    "at their time limit; crosses at the upper edge: runs without an answer for another reason."
)


def panel(axes: Axes, cells: pd.DataFrame, styles: dict[str, dict[str, Any]]) -> None:
    """Draws the cells of one size: one line per method of `styles`, and marks for answers outside the limit
    and for missing ones.
    """
    for method, look in styles.items():
        line = cells[cells["method"] == method].sort_values("active")  # broken where a time is missing
        axes.plot(line["active"], line["load_case_s"], **look)
        outside = line[line["verdict"] != "within"]
        axes.plot(outside["active"], outside["load_case_s"], color=look["color"], **OUTSIDE)
    axes.set_yscale("log")
    axes.margins(x=0.07, y=0.08)
    unfinished.unfinished(axes, cells, "active", styles)
    style.plain_log(axes.yaxis)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    if (m := cells["m"].iloc[0]) > 0:
        style.percent_above(axes, m)


def entries(cells: pd.DataFrame) -> list[Line2D]:
    """Legend entries for the marks that occur."""
    outside = [Line2D([], [], label="not within the limit", color=style.GREY, **OUTSIDE)]
    return [*(outside if cells["verdict"].isin(ANSWERED[1:]).any() else []), *unfinished.entries(cells)]
