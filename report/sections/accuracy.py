"""Time against achieved accuracy: one work–precision diagram per size."""

from __future__ import annotations

from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from harness.results.schema import ANSWERED
from report.analysis.drawn import drawn_cells, omission_note, scenes, sizes
from report.analysis.precision import CURVE_POINTS, LARGEST_ERROR_MM, in_view, pareto, with_errors
from report.document.blocks import Figure, Place, Section, Text
from report.figures import style, unfinished
from report.figures.lines import looks
from report.figures.pareto_front import staircase
from report.results.reader import Results

PLACE = Place(330)


def section(results: Results) -> Section | None:
    cells = in_view(with_errors(drawn_cells(results)))
    figures = [figure for n in sizes(results) if (figure := _figure(results, cells, n))]
    if not figures:
        return None
    words = (
        "Seconds per load case against the achieved displacement error of the same run; lower left is "
        f"better, and right of the dotted line at {results.limit} the error is too large. The grey staircase "
        "is the Pareto front: nothing is both faster and more accurate than its corners. Runs of a solver "
        f"with at least {CURVE_POINTS} tolerances are joined; bars span the repeats. Open triangles: runs "
        "that did not finish, at their time limit; crosses at the upper edge: runs without an answer for "
        "another reason. Both are placed at the smallest error the solver did reach, or at the right edge if "
        "it reached none. Errors below the reference error bound are drawn at that bound, errors above "
        f"{LARGEST_ERROR_MM:g} mm at {LARGEST_ERROR_MM:g} mm."
    )
    return Section("Time against achieved accuracy", [Text(words + omission_note(results)), *figures])


def _figure(results: Results, cells: pd.DataFrame, n: int) -> Figure | None:
    """The scenes of a size with the fewest and the most active contacts, side by side."""
    of_size = [s for s in scenes(results, n) if cells.loc[cells["scene"] == s, "error"].notna().any()]
    ends = list(dict.fromkeys(of_size[:1] + of_size[-1:]))
    if not ends:
        return None
    cells = cells[cells["scene"].isin(ends)]
    styles = looks(results, cells)
    handles = [*style.legend_entries(styles), *unfinished.entries(cells)]
    drawing = style.figure_above(3.4, handles)
    panels = drawing.subplots(1, len(ends), sharex=True, sharey=True, squeeze=False)[0]
    limit = cells["limit_mm"].max()
    limit = limit if limit > 0 else 1e-7
    low, high = min(cells["error"].min(), limit), max(cells["error"].max(), limit)
    panels[0].set(xscale="log", yscale="log", xlim=(low / 4, high * 6), ylabel="time per load case, s")
    panels[0].xaxis.set_major_locator(LogLocator(numticks=9))
    panels[0].xaxis.set_minor_locator(NullLocator())
    for axes, scene in zip(panels, ends, strict=True):
        here = cells[cells["scene"] == scene]
        _curves(axes, here.dropna(subset=["error"]), styles)
        axes.axvline(limit, color="black", linewidth=1.1, linestyle=(0, (1, 1.5)))
        active = here["active"].iloc[0]
        axes.set_title(f"n = {n}" + (f", {active:.0f} active" if active == active else ""))
        axes.set_xlabel("displacement error, mm (max norm)")
    for axes, scene in zip(panels, ends, strict=True):
        _unfinished(axes, cells[cells["scene"] == scene], styles)
    for axes, scene in zip(panels, ends, strict=True):
        staircase(axes, pareto(cells[cells["scene"] == scene].dropna(subset=["error"])), "load_case_s")
    style.plain_log(panels[0].yaxis)
    return Figure(f"time-accuracy-{n}", f"*Time against achieved accuracy, n = {n}.*", drawing)


def _curves(axes: Axes, points: pd.DataFrame, styles: dict[str, dict[str, Any]]) -> None:
    for method, line in points.groupby("method"):
        look = styles[str(method)]
        ordered = line.sort_values("tolerance", ascending=False)
        axes.plot(ordered["error"], ordered["load_case_s"], **look)
        several = line[line["most_s"] > line["least_s"]]
        axes.vlines(several["error"], several["least_s"], several["most_s"], color=look["color"], linewidth=1)


def _unfinished(axes: Axes, cells: pd.DataFrame, styles: dict[str, dict[str, Any]]) -> None:
    missed = cells[~cells["verdict"].isin(ANSWERED)].drop_duplicates(["method", "status"])
    reached = missed["method"].map(cells.groupby("method")["error"].min())
    at = reached.fillna(axes.get_xlim()[1] / 2)
    unfinished.unfinished(axes, missed.assign(at=at), "at", styles, inside=True)
