"""SciPy's L-BFGS-B on the dual form, as a user would call it: objective, gradient and the bounds λ ≥ 0.

R. H. Byrd, P. Lu, J. Nocedal and C. Zhu, SIAM J. Sci. Comput. 16:1190–1208, 1995. It stops at a projected
gradient max|λ − max(λ − y, 0)| ≤ tolerance, in which a force in N stands beside a gap in mm: "solved"; or
when the objective no longer changes in its last digit, which it also calls a success: "inaccurate".
"""

from scipy.optimize import minimize

from problems.forms.assembly import Vector
from solvers.adapter import clipped
from solvers.base import Answer, DualLoadCase, Status
from solvers.method import Method, State, first_point

LIMIT = 1_000_000  # iterations, and products with Q


class LBfgsB(Method):
    """It starts from λ = 0 or a warm start. Takes no options."""

    distribution = "scipy"

    def solved(self, ready: State, load: DualLoadCase, tolerance: float) -> Answer:
        Q, (start, _) = ready.Q.T, first_point(ready.dual_start, load)  # symmetric

        def objective(lam: Vector) -> tuple[float, Vector]:
            """½λᵀQλ − pᵀλ, N·mm, and its gradient y = Qλ − p, mm."""
            y = Q @ lam - load.p
            return float(lam @ (y - load.p)) / 2, y

        result = minimize(
            objective,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=[(0.0, None)] * len(load.p),
            options={"ftol": 0.0, "gtol": tolerance, "maxiter": self.most(LIMIT), "maxfun": LIMIT},
        )
        message = str(result.message)
        details = {"products": int(result.nfev), "message": message}
        status: Status = "iteration_limit" if result.status == 1 else "inaccurate"
        if result.success and "PROJECTED GRADIENT" in message:
            status = "solved"
        return clipped(Answer(status, result.x, iterations=result.nit, details=details), tolerance)
