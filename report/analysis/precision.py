"""Errors and Pareto fronts."""

from __future__ import annotations

import math

import pandas as pd

from report.results.reader import Results

#: The accuracies for which costs and settings are given, mm.
ACCURACIES = (1e-3, 1e-5, 1e-7, 1e-9)
#: The fewest tolerances of one method on one scene that make a curve.
CURVE_POINTS = 3
ZERO_ERROR_MM = 1e-16  # counts as an error of zero
#: A reference whose error bound exceeds this share of an accuracy cannot judge it.
BOUND_SHARE = 0.1


def with_errors(cells: pd.DataFrame) -> pd.DataFrame:
    """The cells with `error`, mm: the displacement error, at least the reference error bound; missing if
    there was no answer.
    """
    bound = cells.groupby("scene")["reference_bound_mm"].transform("max")
    measured = cells["displacement_error_mm"].where(cells["load_case_s"].notna())
    return cells.assign(reference_bound_mm=bound, error=measured.clip(lower=bound).clip(lower=ZERO_ERROR_MM))


def curves(cells: pd.DataFrame) -> set[str]:
    """The methods with at least CURVE_POINTS tolerances on a scene."""
    tolerances = cells.groupby(["method", "scene"])["tolerance"].nunique()
    return set(tolerances.index.get_level_values("method")[tolerances >= CURVE_POINTS])


def swept(results: Results) -> pd.DataFrame:
    """The cells that were run, with errors; none if no method has a curve."""
    cells = results.cells[~results.cells["status"].isin(["unsupported", "not_run"])]
    return with_errors(cells) if curves(cells) else with_errors(cells.iloc[:0])


def pareto(points: pd.DataFrame) -> pd.DataFrame:
    """The points that no other beats in both `error` and `load_case_s`, by increasing error."""
    ordered = points.sort_values(["error", "load_case_s"])
    return ordered[ordered["load_case_s"] < ordered["load_case_s"].cummin().shift(fill_value=math.inf)]


def accurate(cells: pd.DataFrame, accuracy_mm: float) -> pd.Series[bool]:
    """Where the error is at most accuracy_mm, and the reference accurate enough to say so."""
    cells = with_errors(cells)
    unknown = cells["reference_bound_mm"] > BOUND_SHARE * accuracy_mm
    return (cells["error"] <= accuracy_mm) & ~unknown


def judged(cells: pd.DataFrame, accuracy_mm: float) -> bool:
    """Whether the references of some cells are accurate enough to decide that an error is ≤ accuracy_mm."""
    return not cells["reference_bound_mm"].max() > BOUND_SHARE * accuracy_mm
