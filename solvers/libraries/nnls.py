"""SciPy's non-negative least squares on the dual form: min ‖Uλ − U⁻ᵀp‖², λ ≥ 0, with Q = UᵀU.

C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, 1974, chapter 23: an active-set method that
closes one contact at a time. It takes no tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.linalg as sla
from scipy.optimize import nnls

from problems.forms.assembly import Matrix
from solvers.adapter import Converted, dense
from solvers.base import Answer, Form, LoadCase, Problem, Solver, failed

LIMIT = 100  # iterations, in units of m


@dataclass(frozen=True)
class _Factored:
    converted: Converted
    U: Matrix


class Nnls(Solver):
    """Takes no options."""

    forms: ClassVar[tuple[Form, ...]] = ("dual",)
    distribution = "scipy"

    def convert(self, problem: Problem) -> Converted:
        return Converted(problem, dense(problem.blocks))

    def prepare(self, data: Converted) -> _Factored | Answer:
        """U; a failed answer if Q is not positive definite."""
        try:
            return _Factored(data, sla.cholesky(data.P))
        except np.linalg.LinAlgError as error:
            return failed(f"Q is not positive definite: {error}")

    def solve(self, ready: _Factored | Answer, load: LoadCase, tolerance: float) -> Answer:
        if isinstance(ready, Answer):
            return ready
        details = {"tolerance": "not taken"}
        b = sla.solve_triangular(ready.U, load.p, trans="T")
        try:
            lam, _ = nnls(ready.U, b, maxiter=LIMIT * len(b))
        except RuntimeError as error:  # too many iterations
            return Answer("failed", None, details=details | {"message": str(error)})
        return ready.converted.answer("solved", tolerance, lam, None, details=details)
