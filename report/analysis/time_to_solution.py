"""The seconds of each stage from the scene to the answer, in each form; exponents of growth with the size.

    sparse    model K̂, B, f̂                               then preparation (factors of K̂, …) and solve
    dual      condensation of the model to K, factors, Q   then preparation, solve, p and x
    primal    condensation (and factors and Q, for the solvers of ours that use them)

The total of k load cases is that of the first, from the scene on, and k − 1 times set-up, solve and recovery.
Matrices that came from the cache count with the seconds that it took to make them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd

from harness.results.schema import BUILDING, DENSE_FORMS
from report.document.blocks import records
from report.document.numbers import as_number
from report.results.reader import Results
from report.results.rows import cells_of

LOAD_CASES = (1, 10, 1000)
#: The stages in their order, the last two per load case.
STAGES = ("model_s", "K_s", "factors_s", "Q_s", "once_s", "solving_s", "recovery_s")
PER_LOAD_CASE = 2
FEWEST = 5  # sizes that a fit should have


@lru_cache(maxsize=4)  # several sections ask for the same
def stage_seconds(results: Results) -> pd.DataFrame:
    """The cells of single load cases with the seconds of each stage, 0 where there is none, `total_<k>_s` for
    each k of LOAD_CASES (missing unless the answer is within the limit and all stages are known), and
    `stored_mib`, the size of the dense matrices it needs. Empty if all have condensed matrices, or none has.
    """
    rows = results.rows[results.rows["case"].isna() & (results.rows["status"] != "unsupported")]
    dense = rows["form"].isin(DENSE_FORMS)
    if dense.all() or not dense.any():
        return results.cells.iloc[:0]
    cells = cells_of(rows.reset_index(drop=True))
    facts: dict[Any, dict[str, Any]] = {}
    for problem in records(results.problems):  # of a scene, by machine, and the last one
        scene = problem.get("scene")
        facts |= {scene: problem, (scene, problem.get("machine")): problem}
    built = [
        _built(cell, facts.get((cell["scene"], cell["machine"])) or facts.get(cell["scene"], {}))
        for cell in records(cells)
    ]
    lines = cells.assign(**{name: [stages[name] for stages in built] for name in built[0]})
    lines["solving_s"] = lines["setup_s"].fillna(0.0) + lines["solve_s"]
    lines["recovery_s"] = lines["form_s"].fillna(0.0)
    stages = lines[list(STAGES)]
    first = stages.sum(axis=1, skipna=False).where(lines["verdict"] == "within")
    for k in LOAD_CASES:
        lines[f"total_{k}_s"] = first + (k - 1) * stages.iloc[:, -PER_LOAD_CASE:].sum(axis=1)
    return lines


def _built(cell: Mapping[str, Any], problem: Mapping[str, Any]) -> dict[str, float]:
    """Seconds of the stages before the solver's own preparation, and MiB of the dense matrices."""
    built = {"model_s": 0.0, "K_s": 0.0, "factors_s": 0.0, "Q_s": 0.0, "stored_mib": 0.0}
    if cell["form"] not in DENSE_FORMS:
        return built | {"model_s": cell["model_s"]}
    seconds, sizes = _numbers(problem.get("build_s")), _numbers(problem.get("stored_mib"))
    stages = [stage for stage in str(cell["stages"]).split() if stage in BUILDING]
    if not stages:  # a run that was stopped does not say
        stages = ["K", "factors", "Q"] if cell["form"] == "dual" or cell["owner"] != "library" else ["K"]
    for stage in stages:
        first, *others = (seconds.get(step, np.nan) for step in BUILDING[stage])
        built[f"{stage}_s"] = first + float(np.nansum(others))  # springs between parts, if there are any
        built["stored_mib"] += sizes.get(stage, np.nan)
    return built


def _numbers(part: object) -> dict[str, float]:
    """The numbers of a part of a scene's row."""
    items = part.items() if isinstance(part, dict) else ()
    return {name: number for name, value in items if (number := as_number(value)) is not None}


@dataclass(frozen=True)
class Exponent:
    """y ≈ c·n^slope over `points` sizes; `error`: the standard error of the slope."""

    slope: float
    error: float
    points: int

    def __str__(self) -> str:
        few = "" if self.points >= FEWEST else f" ({self.points} sizes only)"
        return f"{self.slope:.2f} ± {self.error:.2f}{few}"


def exponent(n: Sequence[float], y: Sequence[float]) -> Exponent | None:
    """Least squares in log–log; missing and non-positive values are ignored. None below three sizes."""
    pairs = [(math.log(a), math.log(b)) for a, b in zip(n, y, strict=True) if b is not None and b > 0]
    if len({a for a, _ in pairs}) < 3:
        return None
    x, z = np.array(pairs).T
    (slope, _), covariance = np.polyfit(x, z, 1, cov=True)
    return Exponent(float(slope), math.sqrt(covariance[0, 0]), len(pairs))
