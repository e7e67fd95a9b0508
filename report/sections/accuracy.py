"""Accuracy: what it costs, and whose tolerance can be trusted."""

from operator import itemgetter
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from report.analysis.standings import (
    ACCURACIES,
    can_judge,
    cells_of_curves,
    curves,
    fastest_first,
    geometric_mean,
    pareto,
)
from report.document.blocks import Column, Figure, Section, Table, number, word
from report.document.numbers import MISSING, power, significant, tidy_power, whole
from report.figures import style
from report.figures.line_charts import styles_of
from report.results.reader import Results
from report.results.rows import in_order, named

LARGEST_ERROR_MM = 1.0  # larger errors are drawn there
DOTTED: dict[str, Any] = {"color": "black", "linewidth": 1.1, "linestyle": (0, (1, 1.5))}
STAIRCASE: dict[str, Any] = {"color": "#CFCFCF", "linewidth": 3.5, "zorder": 1, "drawstyle": "steps-post"}


def costs(results: Results) -> Section | None:
    """Time against error by size, and the time to reach each of ACCURACIES."""
    cells = cells_of_curves(results)
    if cells["error"].isna().all():
        return None
    sizes = [of_size for _, of_size in cells.groupby("n")]
    columns = [number("n", "n", whole), word("solver (form)", "method")]
    for accuracy in map(tidy_power, ACCURACIES):
        columns.append(Column(f"≤ {accuracy} mm", itemgetter(f"price_{accuracy}")))
    caption = (
        "*Price list*: seconds per load case of the fastest run on each scene with an error of at most that "
        "of the heading, the geometric mean over the scenes; >: stopped at the time limit; not reached: "
        "with the smallest error on the worst scene."
    )
    table = Table("price-list", caption, pd.concat([_prices(of_size) for of_size in sizes]), columns)
    points = cells[np.isfinite(cells["error"])]
    figures = [_diagram(of_size, results.limit) for _, of_size in points.groupby("n") if curves(of_size)]
    return Section("The cost of accuracy", [*figures, table])


def _prices(cells: pd.DataFrame) -> pd.DataFrame:
    """One line per method at one size: the seconds and their text for each of ACCURACIES."""
    lines = pd.DataFrame({"n": cells["n"].iloc[0], "method": in_order(cells, "method")})
    scenes = cells["scene"].nunique()
    for accuracy in ACCURACIES:
        name = tidy_power(accuracy)
        means = fastest_first(cells, "method", accuracy_mm=accuracy).set_index("method")["seconds"]
        lines[f"seconds_{name}"] = lines["method"].map(means)
        lines[f"price_{name}"] = [
            f"{significant(means[method])} s" if method in means else _missed(runs, accuracy, scenes)
            for method in lines["method"]
            for runs in [cells[cells["method"] == method]]
        ]
    return lines


def _missed(runs: pd.DataFrame, accuracy: float, scenes: int) -> str:
    """Why a method has no price: the time limit only where no answer missed the accuracy."""
    if runs["scene"].nunique() < scenes:
        return MISSING
    if not can_judge(runs, accuracy):
        return "cannot be judged"
    late = runs["error"].isna() & (runs["status"] == "time_limit")
    known = runs["load_case_s"].where(runs["error"] <= accuracy, runs["time_limit_s"].where(late))
    if (least := known.groupby(runs["scene"]).min()).notna().all():
        return f"> {significant(geometric_mean(least))} s"
    best = runs.groupby("scene")["error"].min()
    return "no answer" if best.isna().any() else f"not reached ({power(best.max(), 2)})"


def _diagram(cells: pd.DataFrame, limit: str) -> Figure:
    """Work–precision on the scenes with the fewest and the most active contacts, side by side."""
    n = f"{cells['n'].iloc[0]:.0f}"
    points = cells.assign(error=cells["error"].clip(upper=LARGEST_ERROR_MM))
    scenes = points.drop_duplicates("scene").sort_values(["active", "scene"])["scene"].tolist()
    ends = list(dict.fromkeys([scenes[0], scenes[-1]]))
    points = points[points["scene"].isin(ends)]
    joined, styles = curves(points), styles_of(points)
    styles = {name: look if name in joined else look | {"linestyle": ""} for name, look in styles.items()}
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
    if cells_of_curves(results).empty or (lines := trust(results)).empty:
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
    table = Table("asked-achieved", caption, lines, columns)
    return Section("Requested tolerance and achieved error", [table])


def trust(results: Results) -> pd.DataFrame:
    """One line per method: of its runs reported as solved, how many exceed the tolerance, and how many
    exceed the limit although the tolerance was no larger. Without a proven reference, a run does not count.
    """
    rows = named(results.rows)
    error = rows["displacement_error_mm"] - rows["reference_bound_mm"]
    said = (rows["status"] == "solved") & np.isfinite(error) & (rows["tolerance"] > 0)
    rows, error = rows[said], error[said].clip(lower=0.0)
    rows = rows.assign(worst_ratio=error / rows["tolerance"], tight=rows["tolerance"] <= rows["limit_mm"])
    rows = rows.assign(
        above_tolerance=rows["worst_ratio"] > 1, tight_outside=rows["tight"] & (error > rows["limit_mm"])
    )
    lines = rows.groupby("method")[["above_tolerance", "tight", "tight_outside"]].sum()
    lines = lines.assign(
        solved=rows.groupby("method").size(), worst_ratio=rows.groupby("method")["worst_ratio"].max()
    )
    return lines.loc[in_order(rows, "method")].reset_index()
