"""The cost of accuracy: the time to reach it, and the factor in time per further digit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from report.analysis.precision import ACCURACIES, CURVE_POINTS, judged, pareto, swept
from report.document.blocks import Column, Place, Section, Table, number, word
from report.document.numbers import MISSING, power, significant, tidy_power, whole
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(340)

REACHED, LATE, MISSED, UNJUDGED, NOT_RUN = "reached", "not in time", "missed", "cannot be judged", "not run"
#: The state of a size is the first of these that occurs among its scenes.
WORST_FIRST = (NOT_RUN, UNJUDGED, MISSED, LATE, REACHED)
DIGITS = 2  # the fewest that a Pareto front spans for a factor to be fitted


def section(results: Results) -> Section | None:
    cells = swept(results)
    if cells.empty:
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
        "*Price list*: seconds per load case of the fastest run on each scene with a displacement error of "
        "at most that of the heading, the geometric mean over the scenes of the size; nothing is "
        "extrapolated. >: a run that might have reached it was stopped at its time limit. Not reached: no "
        "run did, and none was stopped by the clock; the smallest error on the worst scene is given. Cannot "
        "be judged: the reference error bound exceeds a tenth of the accuracy. –: not run on every scene. "
        "Last column: the factor in time per further digit, from a straight line through the solver's own "
        f"Pareto front in log–log, if that has at least {CURVE_POINTS} points and spans {DIGITS} digits on "
        "every scene."
    )
    return Section("The cost of accuracy", [Table("price-list", caption, pd.DataFrame(lines), columns)])


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
    return float(np.exp(np.mean(np.log(values))))


def _shown(line: Mapping[str, Any], name: str) -> str:
    state, seconds = line[f"state_{name}"], line[f"seconds_{name}"]
    if state == MISSED:
        best = line["best_error_mm"]
        return f"not reached ({power(best, 2)})" if best == best else "no answer"
    words = {REACHED: f"{significant(seconds)} s", LATE: f"> {significant(seconds)} s", NOT_RUN: MISSING}
    return words.get(state, state)
