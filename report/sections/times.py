"""Time against the number of active contacts: the paper's Figures 5 to 7 in shape."""

from __future__ import annotations

from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from report.analysis.shown import best, left_out, of_tolerances, styles_of
from report.document.blocks import Figure, Section
from report.figures import marks, style
from report.results.reader import ANSWERED, Results

PANEL = 3.0  # inches
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


def section(results: Results) -> Section | None:
    cells = best(results)
    cells = cells[cells.groupby("n")["active"].transform("nunique") > 1]
    if cells["load_case_s"].notna().sum() == 0:
        return None
    sizes = sorted(cells["n"].unique())
    styles = styles_of(results, cells)
    drawing = style.figure(PANEL * len(sizes) + 0.3)
    for axes, n in zip(drawing.subplots(len(sizes), 1, squeeze=False)[:, 0], sizes, strict=True):
        of_size = cells[cells["n"] == n]
        panel(axes, of_size, styles)
        axes.set_ylabel("time a load case, s")
        m = of_size["m"].iloc[0]
        axes.set_title(f"n = {n:.0f}" + (f", m = {m:.0f}" if m > 0 else ""), pad=5)
    axes.set_xlabel("active contacts")
    handles = [*style.legend_entries(styles), *entries(cells)]
    drawing.legend(handles=handles, loc="outside right upper", handlelength=3.2)
    caption = (
        "*Seconds a load case (set-up + solve + the dual form's own cost) against the active contacts*, "
        f"below in number, above in % of m.{of_tolerances(results)} Solid and filled: dual form; dashed "
        "and hollow: primal. " + MARKS.format(limit=results.limit) + left_out(results)
    )
    return Section("Time against active contacts", [Figure("time-active", caption, drawing)])


def panel(axes: Axes, cells: pd.DataFrame, styles: dict[str, dict[str, Any]]) -> None:
    """One size: a line a series of `styles`, and the marks of what is no answer within the limit."""
    for series, look in styles.items():
        line = cells[cells["series"] == series].sort_values("active")  # broken where a time is missing
        axes.plot(line["active"], line["load_case_s"], **look)
        outside = line[line["verdict"] != "within"]
        axes.plot(outside["active"], outside["load_case_s"], color=look["color"], **OUTSIDE)
    axes.set_yscale("log")
    axes.margins(x=0.07, y=0.08)
    marks.unfinished(axes, cells, "active", styles)
    style.plain_log(axes.yaxis)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    if (m := cells["m"].iloc[0]) > 0:
        style.percent_above(axes, m)


def entries(cells: pd.DataFrame) -> list[Line2D]:
    """Legend entries for those of the panel's marks that occur."""
    outside = [Line2D([], [], label="not within the limit", color=style.GREY, **OUTSIDE)]
    return [*(outside if cells["verdict"].isin(ANSWERED[1:]).any() else []), *marks.entries(cells)]
