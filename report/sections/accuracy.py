"""Time against the accuracy that was achieved: a work–precision diagram."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from .. import style
from ..blocks import Figure, Section
from ..rows import Results
from ..shown import drawn, left_out, middle_scenes, styles_of

PANEL = 2.9  # inches
EXACT = 1e-16  # mm: where an error of zero is drawn
APART = 0.06  # of a panel's height: the least distance between two names in it


def section(results: Results) -> Section | None:
    scenes = middle_scenes(results)
    cells = drawn(results)
    cells = cells[cells["scene"].isin(scenes)]
    points = cells.dropna(subset=["load_case_s", "displacement_error_mm"])
    if points.empty:
        return None
    points = points.assign(error=points["displacement_error_mm"].clip(lower=EXACT))
    scenes = [scene for scene in scenes if scene in set(points["scene"])]
    styles = styles_of(results, points)
    drawing = style.figure(PANEL * len(scenes) + 0.3)
    panels = drawing.subplots(len(scenes), 1, sharex=True, squeeze=False)[:, 0]
    limit = points["limit_mm"].max()
    limit = limit if limit > 0 else 1e-7
    panels[0].set(xscale="log", xlim=(points["error"].min() / 300, max(points["error"].max(), limit) * 6))
    panels[0].xaxis.set_major_locator(LogLocator(numticks=12))
    panels[0].xaxis.set_minor_locator(NullLocator())
    for axes, scene in zip(panels, scenes, strict=True):
        _panel(axes, points[points["scene"] == scene], limit, styles)
    axes.set_xlabel("displacement error, mm (max norm)")
    drawing.legend(handles=style.legend_entries(styles), loc="outside right upper", handlelength=3.2)
    caption = (
        "*Seconds a load case against the displacement error that was achieved*, both of the same run, on "
        "the middle scene of each size. Down and left is better; right of the dotted line at "
        f"{results.limit} is not accurate enough. The grey staircase is the Pareto front: its corners "
        "are beaten by nothing that is both faster and more accurate. Shaded: errors below the "
        "bound on the reference's own. Points of one solver at several tolerances are joined. Runs without "
        "an answer have no place here." + left_out(results)
    )
    return Section("Time against achieved accuracy", [Figure("time-accuracy", caption, drawing)])


def _panel(axes: Axes, points: pd.DataFrame, limit: float, styles: dict[str, dict[str, Any]]) -> None:
    for series, line in points.groupby("series"):
        ordered = line.sort_values("tolerance", ascending=False)
        axes.plot(ordered["error"], ordered["load_case_s"], **styles[str(series)])
    axes.set(yscale="log", ylabel="time a load case, s")
    low, high = points["load_case_s"].min(), points["load_case_s"].max()
    axes.set_ylim(low / 1.8, high * 1.5)
    left, right = axes.get_xlim()
    front = pareto(points)
    errors, seconds = front["error"].tolist(), front["load_case_s"].tolist()
    staircase: dict[str, Any] = {
        "color": "#CFCFCF",
        "linewidth": 3.5,
        "zorder": 1,
        "solid_joinstyle": "miter",
    }
    axes.step([errors[0], *errors, right], [high * 2, *seconds, seconds[-1]], where="post", **staircase)
    for label, error, time in _named(front[front["error"] <= limit], math.log(high / low)):
        beside: dict[str, Any] = {"textcoords": "offset points", "ha": "right", "va": "top", "fontsize": 8}
        axes.annotate(label, (error, time), (-6, -5), **beside)
    axes.axvline(limit, color="black", linewidth=1.1, linestyle=(0, (1, 1.5)))
    bound = points["reference_bound_mm"].max()
    if bound > left:
        axes.axvspan(left, bound, color="#F0F0F0", zorder=0)
    style.plain_log(axes.yaxis)
    n, active = points["n"].iloc[0], points["active"].iloc[0]
    axes.set_title(f"n = {n:.0f}" + (f", {active:.0f} active" if active == active else ""))


def pareto(points: pd.DataFrame) -> pd.DataFrame:
    """The points that no other beats in both `error` and `load_case_s`, by growing error."""
    ordered = points.sort_values(["error", "load_case_s"])
    return ordered[ordered["load_case_s"] < ordered["load_case_s"].cummin().shift(fill_value=float("inf"))]


def _named(front: pd.DataFrame, height: float) -> Iterator[tuple[str, float, float]]:
    """Label and place of the corners to name: from the fastest on, one of each series, none close
    above the last."""
    series: set[str] = set()
    last = -math.inf
    columns = ("series", "label", "error", "load_case_s")
    for name, label, error, seconds in front.sort_values("load_case_s")[[*columns]].to_numpy().tolist():
        if name not in series and math.log(seconds) - last > height * APART:
            yield label, error, seconds
            series.add(name)
            last = math.log(seconds)
