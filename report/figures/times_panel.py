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
#: What the marks of `panel` mean, for captions.
MARKS = (
    "Crosses on a line, in its colour: answered, but not within {limit}. Open triangles stand at the time "
    "limit of runs that did not finish; crosses at the upper edge, for runs that gave no answer for another "
    "reason."
)


def panel(axes: Axes, cells: pd.DataFrame, styles: dict[str, dict[str, Any]]) -> None:
    """One size: a line a method of `styles`, and the marks of what is no answer within the limit."""
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
    """Legend entries for those of the panel's marks that occur."""
    outside = [Line2D([], [], label="not within the limit", color=style.GREY, **OUTSIDE)]
    return [*(outside if cells["verdict"].isin(ANSWERED[1:]).any() else []), *unfinished.entries(cells)]
