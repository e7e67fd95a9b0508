"""What the sections on accuracy share: errors, the Pareto front, and which settings reach an accuracy."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from report.results.reader import Results

from .drawn import drawn

#: mm: the accuracies that prices and advice are given for.
ACCURACIES = (1e-3, 1e-5, 1e-7, 1e-9)
#: So many tolerances of one method on one scene make a curve; fewer are points.
ENOUGH = 3
EXACT = 1e-16  # mm: what an error of zero counts as
WRONG = 1.0  # mm: more than any gap here
#: A reference whose bound exceeds this share of an accuracy cannot judge it.
SHARE = 0.1


def with_errors(cells: pd.DataFrame) -> pd.DataFrame:
    """The cells with `error`, mm: the displacement error, never below the bound on the reference's own,
    missing where there was no answer.
    """
    bound = cells.groupby("scene")["reference_bound_mm"].transform("max")
    measured = cells["displacement_error_mm"].where(cells["load_case_s"].notna())
    return cells.assign(reference_bound_mm=bound, error=measured.clip(lower=bound).clip(lower=EXACT))


def in_view(cells: pd.DataFrame) -> pd.DataFrame:
    """For figures: errors above WRONG are drawn there."""
    return cells.assign(error=cells["error"].clip(upper=WRONG))


def curves(cells: pd.DataFrame) -> set[str]:
    """The method with ENOUGH tolerances on a scene."""
    tolerances = cells.groupby(["method", "scene"])["tolerance"].nunique()
    return set(tolerances.index.get_level_values("method")[tolerances >= ENOUGH])


def swept(results: Results) -> pd.DataFrame:
    """The cells drawn, with errors; none of them where no method has a curve."""
    cells = with_errors(drawn(results))
    return cells if curves(cells) else cells.iloc[:0]


def pareto(points: pd.DataFrame, time: str = "load_case_s") -> pd.DataFrame:
    """The points that no other beats in both `error` and `time`, by growing error."""
    ordered = points.sort_values(["error", time])
    return ordered[ordered[time] < ordered[time].cummin().shift(fill_value=math.inf)]


def judged(cells: pd.DataFrame, accuracy: float) -> bool:
    """Whether the references of some cells are good enough to say that an error is ≤ accuracy."""
    return not cells["reference_bound_mm"].max() > SHARE * accuracy


def settings(cells: pd.DataFrame, accuracy: float, load_cases: float = math.inf) -> pd.Series[float]:
    """Seconds a load case by label, the fastest first, of those with an error ≤ accuracy on every scene
    of `cells`: the geometric mean over the scenes. What is paid once an assembly is shared by `load_cases`.
    """
    cost = cells["load_case_s"] + cells["once_s"].fillna(0.0) / load_cases
    good = cells.assign(cost=cost)[cells["error"] <= accuracy]
    if good.empty:
        return pd.Series(dtype=float)
    table = good.pivot_table(index="label", columns="scene", values="cost")
    complete = table.reindex(columns=cells["scene"].unique()).dropna()
    return np.exp(np.log(complete).mean(axis=1)).sort_values()
