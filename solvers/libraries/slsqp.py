"""SciPy's SLSQP on the dual form, as a user would call it: objective, gradient and the bounds λ ≥ 0.

D. Kraft, DFVLR-FB 88-28, 1988: sequential least squares with a dense quasi-Newton matrix, O(m³) operations
per iteration and about as many iterations as contacts. For some hundred contacts.

It stops when the objective changes by less than `ftol`, here the square of the tolerance, as the objective is
quadratic in the error. It calls that a success; here it is "solved" only if the projected gradient is at
most the tolerance, else "inaccurate".
"""

from __future__ import annotations

from scipy.optimize import minimize

from problems.forms.assembly import Vector
from solvers.adapter import Converted
from solvers.base import Answer, LoadCase
from solvers.minimize import Minimizer, Objective, status_of

LIMIT = 100_000  # iterations
AT_THE_LIMIT = 9  # its status


class Slsqp(Minimizer):
    """Takes no options."""

    def solve(self, ready: tuple[Converted, Vector], load: LoadCase, tolerance: float) -> Answer:
        state, start = ready
        objective = Objective(state.P, load.p)
        found = minimize(
            objective,
            start,
            jac=True,
            method="SLSQP",
            bounds=objective.bounds,
            options={"ftol": tolerance**2, "maxiter": LIMIT},
        )
        details = {"products": objective.products, "message": str(found.message)}
        status = status_of(found.x, found.jac, tolerance, found.status == AT_THE_LIMIT)
        return state.answer(status, load, tolerance, found.x, None, iterations=found.nit, details=details)
