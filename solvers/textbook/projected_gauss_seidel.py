"""Projected Gauss–Seidel with over-relaxation for the dual problem min ½λᵀQλ − pᵀλ, λ ≥ 0.

What physics engines solve their contacts with (C. W. Cryer, SIAM J. Control 9:385–392, 1971).
One contact after another,

    λ_i ← max(0, λ_i − ω y_i/q_ii),    y ← y + Q e_i Δλ_i,    y = Qλ − p,

which converges for 0 < ω < 2, by a factor of about 1 − 1/cond(Q) per sweep: a few digits soon, many never.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import blas

from problems.forms.assembly import Matrix, Vector
from problems.stiffness.dense_block import product
from solvers.base import Answer, DualLoadCase
from solvers.kkt import dual_answer, is_small, kkt_errors, kkt_residual, kkt_status, rounding_bound
from solvers.method import Method, State, first_point
from solvers.options import require

MAX_SWEEPS = 1_000_000
CHECKED = 10  # sweeps after which y is computed anew
SLOWEST, PATIENCE = 0.5, 100  # of the KKT residual after so many checks; a slower decrease ends the method


@dataclass(kw_only=True, frozen=True, eq=False)
class ProjectedGaussSeidel(Method):
    """Projected Gauss–Seidel, from λ = 0 or a warm start.

    Stops when −y, and |y| where λ > 0, are at most max(tolerance, `kkt.rounding_bound`) mm, tested every ten
    sweeps; "solved" if they are at most max(tolerance, 4ε(|p| + |Q|λ)) mm;
    "inaccurate" if a thousand sweeps have not halved it. Iterations are sweeps; the details count a sweep as
    a product with Q.

    Options
    -------
    relaxation : ω.
    """

    distribution = "scipy"
    relaxation: float = 1.5

    def __post_init__(self) -> None:
        valid = 0 < self.relaxation < 2
        require("projected-gauss-seidel", vars(self), relaxation=(valid, "must be between 0 and 2"))

    def solved(self, ready: State, load: DualLoadCase, tolerance: float) -> Answer:
        Q, p = ready.Q, load.p
        lam, y = first_point(ready.dual_start, load)
        products, sweeps = 0, 0
        reached: list[float] = []  # the residual at each check
        limit, cause, most = "", "", self.most(MAX_SWEEPS)
        while True:
            reached.append(kkt_residual(lam, y))
            self.log(sweeps=sweeps, residual_mm=reached[-1])
            if is_small(kkt_errors(lam, y), tolerance, rounding_bound(np.diag(Q), p, lam)):
                break
            if sweeps >= most:
                limit = f"{most} sweeps"
                break
            if len(reached) > PATIENCE and not reached[-1] <= SLOWEST * reached[-1 - PATIENCE]:
                cause = f"{PATIENCE * CHECKED} sweeps did not halve the KKT residual"
                break
            for _ in range(min(CHECKED, most - sweeps)):
                lam = _sweep(Q, lam, y, self.relaxation)
                sweeps += 1
            y, products = product(Q, lam) - p, products + 1
        status, residual = kkt_status(Q, p, lam, y, tolerance)
        details = {"products": products + sweeps}
        return dual_answer(status, lam, residual, details, (sweeps, None), limit, cause)


def _sweep(Q: Matrix, lam: Vector, y: Vector, relaxation: float) -> Vector:
    """λ after all contacts in turn; y is changed in place."""
    columns, scale, forces = Q.T, (relaxation / np.diag(Q)).tolist(), lam.tolist()
    for i, force in enumerate(forces):
        step = max(-scale[i] * float(y[i]), -force)
        if step:
            forces[i] = force + step
            blas.daxpy(columns[i], y, a=step)
    return np.array(forces)
