"""Errors, Pareto fronts and the settings that reach an accuracy: shared by the sections on accuracy."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from report.results.reader import Results

from .drawn import drawn_cells

#: The accuracies for which costs and settings are given, mm.
ACCURACIES = (1e-3, 1e-5, 1e-7, 1e-9)
#: The fewest tolerances of one method on one scene that make a curve; fewer are points.
CURVE_POINTS = 3
ZERO_ERROR_MM = 1e-16  # counts as an error of zero
LARGEST_ERROR_MM = 1.0  # more than any gap here; larger errors are drawn there
#: A reference whose error bound exceeds this share of an accuracy cannot judge it.
BOUND_SHARE = 0.1


def with_errors(cells: pd.DataFrame) -> pd.DataFrame:
    """The cells with `error`, mm: the displacement error, at least the reference error bound; missing if
    there was no answer.
    """
    bound = cells.groupby("scene")["reference_bound_mm"].transform("max")
    measured = cells["displacement_error_mm"].where(cells["load_case_s"].notna())
    return cells.assign(reference_bound_mm=bound, error=measured.clip(lower=bound).clip(lower=ZERO_ERROR_MM))


def in_view(cells: pd.DataFrame) -> pd.DataFrame:
    """For figures: larger errors become LARGEST_ERROR_MM."""
    return cells.assign(error=cells["error"].clip(upper=LARGEST_ERROR_MM))


def curves(cells: pd.DataFrame) -> set[str]:
    """The methods with at least CURVE_POINTS tolerances on a scene."""
    tolerances = cells.groupby(["method", "scene"])["tolerance"].nunique()
    return set(tolerances.index.get_level_values("method")[tolerances >= CURVE_POINTS])


def swept(results: Results) -> pd.DataFrame:
    """The cells drawn, with errors; none if no method has a curve."""
    cells = with_errors(drawn_cells(results))
    return cells if curves(cells) else cells.iloc[:0]


def pareto(points: pd.DataFrame, time: str = "load_case_s") -> pd.DataFrame:
    """The points that no other beats in both `error` and `time`, by increasing error."""
    ordered = points.sort_values(["error", time])
    return ordered[ordered[time] < ordered[time].cummin().shift(fill_value=math.inf)]


def judged(cells: pd.DataFrame, accuracy: float) -> bool:
    """Whether the references of some cells are accurate enough to decide that an error is ≤ accuracy."""
    return not cells["reference_bound_mm"].max() > BOUND_SHARE * accuracy


def settings(cells: pd.DataFrame, accuracy: float, load_cases: float = math.inf) -> pd.Series[float]:
    """Seconds per load case by label, the fastest first, of those with an error ≤ accuracy on every scene of
    `cells`: the geometric mean over the scenes. The time per assembly is shared by `load_cases`.
    """
    cost = cells["load_case_s"] + cells["once_s"].fillna(0.0) / load_cases
    good = cells.assign(cost=cost)[cells["error"] <= accuracy]
    if good.empty:
        return pd.Series(dtype=float)
    table = good.pivot_table(index="label", columns="scene", values="cost")
    complete = table.reindex(columns=cells["scene"].unique()).dropna()
    return np.exp(np.log(complete).mean(axis=1)).sort_values()
