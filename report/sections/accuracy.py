"""Accuracy: what it costs, whose tolerance and which residual can be trusted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from report.analysis.precision import ACCURACIES, CURVE_POINTS, curves, judged, pareto, swept
from report.analysis.standings import geometric_mean
from report.document.blocks import Column, Figure, Section, Table, number, word
from report.document.numbers import MISSING, power, significant, tidy_power, whole
from report.figures import style
from report.figures.lines import styles_of
from report.results.labels import in_order, named
from report.results.reader import Results

REACHED, LATE, MISSED, UNJUDGED, NOT_RUN = "reached", "not in time", "missed", "cannot be judged", "not run"
#: The state of a size is the first of these that occurs among its scenes.
WORST_FIRST = (NOT_RUN, UNJUDGED, MISSED, LATE, REACHED)
DIGITS = 2  # the fewest that a Pareto front spans for a factor to be fitted
LARGEST_ERROR_MM = 1.0  # larger errors are drawn there
PANEL = 2.7  # inches
DOTTED: dict[str, Any] = {"color": "black", "linewidth": 1.1, "linestyle": (0, (1, 1.5))}
STAIRCASE: dict[str, Any] = {"color": "#CFCFCF", "linewidth": 3.5, "zorder": 1, "drawstyle": "steps-post"}


def costs(results: Results) -> Section | None:
    """Time against error by size, and the time to reach each of ACCURACIES."""
    cells = swept(results)
    if cells["error"].isna().all():
        return None
    lines = []
    for _, of_size in cells.groupby("n"):
        scenes = of_size["scene"].unique().tolist()
        for method in in_order(of_size, "method"):
            lines.append(_line(of_size[of_size["method"] == method], scenes))
    columns = [number("n", "n", whole), word("solver (form)", "method")]
    columns += [Column(f"≤ {tidy_power(x)} mm", partial(_shown, name=tidy_power(x))) for x in ACCURACIES]
    columns.append(number("time factor per digit", "factor_per_digit"))
    caption = (
        "*Price list*: seconds per load case of the fastest run on each scene with an error of at most that "
        "of the heading, the geometric mean over the scenes; >: stopped at the time limit; not reached: "
        "with the smallest error on the worst scene. Last column: from the solver's own Pareto front."
    )
    figures = [
        _diagram(of_size, f"{n:.0f}", results.limit) for n, of_size in cells.groupby("n") if curves(of_size)
    ]
    return Section(
        "The cost of accuracy", [*figures, Table("price-list", caption, pd.DataFrame(lines), columns)]
    )


def _line(runs: pd.DataFrame, scenes: list[str]) -> dict[str, Any]:
    by_scene = [runs[runs["scene"] == scene] for scene in scenes]
    line: dict[str, Any] = {
        "n": runs["n"].iloc[0],
        "method": runs["method"].iloc[0],
        "best_error_mm": np.max([group["error"].min() for group in by_scene]),  # missing if one scene's is
        "factor_per_digit": _mean([factor_per_digit(group) for group in by_scene]),
    }
    for accuracy in ACCURACIES:
        prices = [price(group, accuracy) for group in by_scene]
        name = tidy_power(accuracy)
        line[f"state_{name}"] = next(s for s in WORST_FIRST if s in {state for state, _ in prices})
        line[f"seconds_{name}"] = _mean([seconds for _, seconds in prices])
    return line


def price(runs: pd.DataFrame, accuracy: float) -> tuple[str, float]:
    """State and seconds of one method on one scene: the fastest run with an error ≤ accuracy, or else the
    smallest time limit at which a run was stopped, a lower bound.
    """
    if runs.empty:
        return NOT_RUN, math.nan
    if not judged(runs, accuracy):
        return UNJUDGED, math.nan
    good = runs[runs["error"] <= accuracy]
    if len(good):
        return REACHED, float(good["load_case_s"].min())
    late = runs[runs["error"].isna() & (runs["status"] == "time_limit")]
    return (LATE, float(late["time_limit_s"].min())) if len(late) else (MISSED, math.nan)


def factor_per_digit(runs: pd.DataFrame) -> float:
    """10 to the slope of log10 time against −log10 error along the Pareto front of one method on one scene;
    missing for a front of too few points or digits.
    """
    front = pareto(runs.dropna(subset=["error"]))
    if len(front) < CURVE_POINTS or front["error"].max() < 10**DIGITS * front["error"].min():
        return math.nan
    slope = np.polyfit(-np.log10(front["error"]), np.log10(front["load_case_s"]), 1)[0]
    return float(10**slope)


def _mean(values: list[float]) -> float:
    """The geometric mean; missing if one of the values is."""
    return geometric_mean(pd.Series(values)) if not np.isnan(values).any() else math.nan


def _shown(line: Mapping[str, Any], name: str) -> str:
    state, seconds = line[f"state_{name}"], line[f"seconds_{name}"]
    if state == MISSED:
        best = line["best_error_mm"]
        return f"not reached ({power(best, 2)})" if best == best else "no answer"
    words = {REACHED: f"{significant(seconds)} s", LATE: f"> {significant(seconds)} s", NOT_RUN: MISSING}
    return words.get(state, state)


def _diagram(cells: pd.DataFrame, n: str, limit: str) -> Figure:
    """Work–precision on the scenes with the fewest and the most active contacts, side by side."""
    points = cells.dropna(subset=["error"])
    points = points.assign(error=points["error"].clip(upper=LARGEST_ERROR_MM))
    scenes = points.drop_duplicates("scene").sort_values(["active", "scene"])["scene"].tolist()
    ends = list(dict.fromkeys([scenes[0], scenes[-1]]))
    points = points[points["scene"].isin(ends)]
    joined, styles = curves(points), styles_of(points)
    styles = {name: look if name in joined else style.marker_only(look) for name, look in styles.items()}
    drawing = style.figure_above(3.4, style.legend_entries(styles))
    panels: list[Axes] = list(drawing.subplots(1, len(ends), sharex=True, sharey=True, squeeze=False)[0])
    panels[0].set(xscale="log", yscale="log", ylabel="time per load case, s")
    panels[0].xaxis.set_major_locator(LogLocator(numticks=9))
    panels[0].xaxis.set_minor_locator(NullLocator())
    for axes, scene in zip(panels, ends, strict=True):
        here = points[points["scene"] == scene]
        for method, look in styles.items():
            line = here[here["method"] == method].sort_values("tolerance", ascending=False)
            axes.plot(line["error"], line["load_case_s"], **look)
        axes.axvline(cells["limit_mm"].max(), **DOTTED)
        active = here["active"].iloc[0]
        axes.set_title(f"n = {n}" + (f", {active:.0f} active" if active == active else ""))
        axes.set_xlabel("displacement error, mm (max norm)")
    (_, right), (_, top) = panels[0].get_xlim(), panels[0].get_ylim()
    for axes, scene in zip(panels, ends, strict=True):
        front = pareto(points[points["scene"] == scene])
        errors, seconds = front["error"].tolist(), front["load_case_s"].tolist()
        across, up = [errors[0], *errors, right], [top, *seconds, seconds[-1]]
        axes.plot(across, up, scalex=False, scaley=False, **STAIRCASE)
    style.plain_log(panels[0].yaxis)
    caption = (
        f"*Time against achieved accuracy, n = {n}*: lower left is better; dotted: {limit}; grey: the Pareto "
        "front. The tolerances of a solver are joined."
    )
    return Figure(f"time-accuracy-{n}", caption, drawing)


def tolerances(results: Results) -> Section | None:
    """Whose tolerance can be trusted."""
    cells = swept(results).dropna(subset=["error", "tolerance"])
    if cells.empty:
        return None
    columns = [
        word("solver (form)", "method"),
        number("reported solved", "solved", whole),
        number("error above the tolerance", "above_tolerance", whole),
        number("largest error / tolerance", "worst_ratio"),
        number(f"tolerance ≤ {results.limit.removesuffix(' mm')}", "tight", whole),
        number(f"of these, error > {results.limit}", "tight_outside", whole),
    ]
    caption = (
        "*Whose tolerance can be trusted*: the runs that the solver reported as solved, counting every "
        "repeat. The reference error bound is subtracted from the error, in the solver's favour."
    )
    words = (
        "*Error against the requested tolerance*, the worst over the scenes of each size. Solvers apply "
        "their tolerance to different quantities, so only the slope matters: parallel to the dotted "
        "diagonal, or level."
    )
    sizes, styles = sorted(cells["n"].unique()), styles_of(cells)
    handles = style.legend_entries(styles)
    drawing, panels = style.panels(len(sizes), PANEL, handles, sharex=True, sharey=True)
    panels[0].set(xscale="log", yscale="log")
    panels[0].xaxis.set_major_locator(LogLocator(numticks=20))
    for axes, n in zip(panels, sizes, strict=True):
        worst = cells[cells["n"] == n].groupby(["method", "tolerance"], as_index=False)["error"].max()
        for method, look in styles.items():
            line = worst[worst["method"] == method]
            axes.plot(line["tolerance"], line["error"].clip(upper=LARGEST_ERROR_MM), **look)
        axes.axline((1e-6, 1e-6), (1e-5, 1e-5), **DOTTED)
        axes.set(title=f"n = {n:.0f}", ylabel="displacement error, mm")
    panels[-1].set_xlabel("requested tolerance")
    table = Table("asked-achieved", caption, trust(results), columns)
    return Section(
        "Requested tolerance and achieved error", [Figure("asked-achieved", words, drawing), table]
    )


def trust(results: Results) -> pd.DataFrame:
    """One line per method: of its runs reported as solved, how many exceed the tolerance, and how many
    exceed the limit although the tolerance was no larger.
    """
    rows = named(results.rows)
    said = (rows["status"] == "solved") & rows["displacement_error_mm"].notna() & (rows["tolerance"] > 0)
    rows = rows[said]
    error = (rows["displacement_error_mm"] - rows["reference_bound_mm"].fillna(0.0)).clip(lower=0.0)
    rows = rows.assign(worst_ratio=error / rows["tolerance"], tight=rows["tolerance"] <= rows["limit_mm"])
    rows = rows.assign(
        above_tolerance=rows["worst_ratio"] > 1, tight_outside=rows["tight"] & (error > rows["limit_mm"])
    )
    lines = rows.groupby("method")[["above_tolerance", "tight", "tight_outside"]].sum()
    lines = lines.assign(
        solved=rows.groupby("method").size(), worst_ratio=rows.groupby("method")["worst_ratio"].max()
    )
    return lines.loc[in_order(rows, "method")].reset_index()


def residuals(results: Results) -> Section | None:
    """A small residual does not prove a small error."""
    cells = swept(results).dropna(subset=["error", "primal_residual"])
    if cells.empty:
        return None
    small = cells[cells["primal_residual"] <= cells["limit_mm"]]
    outside = small[small["error"] > small["limit_mm"]]
    lines = pd.DataFrame({"method": in_order(cells, "method")})
    for name, runs in (("answers", cells), ("small_residual", small), ("outside", outside)):
        lines[name] = lines["method"].map(runs["method"].value_counts()).fillna(0)
    lines["worst_error_mm"] = lines["method"].map(small.groupby("method")["error"].max())
    columns = [
        word("solver (form)", "method"),
        number("answers", "answers", whole),
        number(f"primal residual ≤ {results.limit}", "small_residual", whole),
        number("of these, error outside", "outside", whole),
        number("their largest error, mm", "worst_error_mm", power),
    ]
    caption = "*What a primal residual within the limit implies*: how often the error was outside it."
    table = Table("residual-error", caption, lines, columns)
    return Section("Residuals and displacement error", [table])
