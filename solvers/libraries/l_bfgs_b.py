"""SciPy's L-BFGS-B on the dual form, as a user would call it: objective, gradient and the bounds λ ≥ 0.

R. H. Byrd, P. Lu, J. Nocedal and C. Zhu, SIAM J. Sci. Comput. 16:1190–1208, 1995. It stops at a projected
gradient max|λ − max(λ − y, 0)| ≤ tolerance, in which a force in N stands beside a gap in mm: "solved"; or
when the objective no longer changes in its last digit, which it also calls a success: "inaccurate".
"""

from __future__ import annotations

from scipy.optimize import minimize

from problems.errors import InputError
from problems.forms.assembly import Vector
from solvers.adapter import Converted
from solvers.base import Answer, LoadCase, Status
from solvers.minimize import Minimizer, Objective

LIMIT = 1_000_000  # iterations, and products with Q


class LBfgsB(Minimizer):
    """maxcor : pairs of vectors in the approximate Hessian."""

    def __init__(self, *, maxcor: int = 10) -> None:
        if type(maxcor) is not int or maxcor < 1:
            raise InputError.one("solver l-bfgs-b", "options.maxcor", maxcor, "must be a whole number from 1")
        self.maxcor = maxcor

    def solve(self, ready: tuple[Converted, Vector], load: LoadCase, tolerance: float) -> Answer:
        state, start = ready
        objective = Objective(state.P, load.p)
        found = minimize(
            objective,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=objective.bounds,
            options={
                "ftol": 0.0,
                "gtol": tolerance,
                "maxcor": self.maxcor,
                "maxiter": LIMIT,
                "maxfun": LIMIT,
            },
        )
        message = str(found.message)
        details = {"products": objective.products, "message": message}
        status: Status = "iteration_limit" if found.status == 1 else "inaccurate"
        if found.success and "PROJECTED GRADIENT" in message:
            status = "solved"
        return state.answer(status, load, tolerance, found.x, None, iterations=found.nit, details=details)
