"""SciPy's trust-constr on the dual form, as a user would call it: with gradient, products with Q, and bounds.

With bounds it is an interior point with trust regions and projected conjugate gradients: R. H. Byrd,
M. E. Hribar and J. Nocedal, SIAM J. Optim. 9:877–900, 1999. It stops when the trust region, N, and the
barrier parameter λᵢyᵢ, N·mm, are at most the tolerance: "solved" if the projected gradient is, too, else
"inaccurate". Its `gtol` is 0: the multipliers in its gradient are fitted by least squares, so that it
vanishes wherever λ > 0, long before λᵢyᵢ do.
"""

from __future__ import annotations

from scipy.optimize import minimize

from problems.forms.assembly import Vector
from solvers.adapter import Converted
from solvers.base import Answer, LoadCase
from solvers.minimize import Minimizer, Objective, status_of

LIMIT = 100_000  # iterations
AT_THE_LIMIT = 0  # its status


class TrustConstr(Minimizer):
    """Takes no options."""

    def solve(self, ready: tuple[Converted, Vector], load: LoadCase, tolerance: float) -> Answer:
        state, start = ready
        objective = Objective(state.P, load.p)
        found = minimize(
            objective,
            start,
            jac=True,
            hess=objective.hessian,
            method="trust-constr",
            bounds=objective.bounds,
            options={"gtol": 0.0, "xtol": tolerance, "barrier_tol": tolerance, "maxiter": LIMIT},
        )
        details = {"products": objective.products, "message": str(found.message)}
        return state.answer(
            status_of(found.x, found.grad, tolerance, found.status == AT_THE_LIMIT),
            load,
            tolerance,
            found.x,
            None,
            iterations=found.nit,
            inner_iterations=found.cg_niter,
            details=details,
        )
