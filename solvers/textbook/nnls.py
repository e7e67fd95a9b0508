"""SciPy's non-negative least squares on the dual form: min ‖Uλ − U⁻ᵀp‖², λ ≥ 0, with Q = UᵀU.

C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, 1974, chapter 23: an active-set method that
closes one contact at a time. It takes no tolerance.
"""

from dataclasses import dataclass

import scipy.linalg as sla
from scipy.optimize import nnls

from problems.forms.assembly import Matrix
from solvers.adapter import clipped
from solvers.base import Answer, DualLoadCase, Problem
from solvers.method import Method, State

LIMIT = 100  # iterations, in units of m


@dataclass(frozen=True, kw_only=True)
class _State(State):
    U: Matrix


class Nnls(Method):
    """Takes no options."""

    distribution = "scipy"

    def state(self, problem: Problem) -> _State:
        return _State(problem=problem, U=sla.cholesky(problem.Q.T))

    def solved(self, ready: _State, load: DualLoadCase, tolerance: float) -> Answer:
        details = {"tolerance": "not taken"}
        b = sla.solve_triangular(ready.U, load.p, trans="T")
        try:
            lam, _ = nnls(ready.U, b, maxiter=LIMIT * len(b))
        except RuntimeError as error:  # too many iterations
            return Answer("failed", details=details | {"message": str(error)})
        return clipped(Answer("solved", lam, details=details), tolerance)
