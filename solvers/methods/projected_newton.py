"""Bertsekas's projected Newton method for the dual problem min ½λᵀQλ − pᵀλ, λ ≥ 0.

D. P. Bertsekas, SIAM J. Control Optim. 20:221–246, 1982. With y = Qλ − p, D = diag(Q) and the contacts at the
bound

    I = {i : q_ii λ_i ≤ ε, y_i > 0},    ε = min(0.01 mm, w),    w = max|min(Dλ, y)|,

the direction is d = −Q_JJ⁻¹ y_J on the others, J, and −D⁻¹y on I. The next point is the first of

    λ(α) = max(λ + αd, 0),    α = 1, ½, ¼, …

on the projection arc that decreases the objective by 1e-4 (−α y_Jᵀd_J + y_Iᵀ(λ − λ(α))_I).

Newton projection for riveting is by S. Baklanov, M. Stefanova and S. Lupuleac (2020, doi
10.1080/10556788.2020.1818079). That paper could not be read, neither its choice of the set nor its step
length nor how it solves its equations: nothing here is taken from it.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from problems.forms.assembly import Matrix, Vector
from problems.forms.product import product
from solvers.base import Answer, LoadCase
from solvers.kkt import judged, kkt_residual, kkt_status, rounding_of
from solvers.method import Method, State, first_point
from solvers.settings import require

LARGEST_EPSILON = 0.01  # mm
DECREASE = 1e-4
SHORTEST = 2.0**-40
RESIDUAL_TARGET = 0.1  # of the tolerance


@dataclass
class _Point:
    """λ (m,) N, y = Qλ − p (m,) mm, and the KKT residual, mm."""

    lam: Vector
    y: Vector

    def __post_init__(self) -> None:
        self.residual = kkt_residual(self.lam, self.y)


@dataclass(kw_only=True, frozen=True, eq=False)
class ProjectedNewton(Method):
    """Projected Newton with a line search along the projection arc, from λ = 0 or a warm start.

    Stops when max(max(−y), max_{λ>0} |y|) is at most 4ε max(|p| + |Qλ|) mm, or at most tolerance/10 and not
    halved by another step, or when no step decreases the objective or halves it. "solved" if it then is at
    most max(tolerance, 4ε max(|p| + |Q|λ)) mm, else "inaccurate". Iterations are Newton steps, each with a
    factorisation of Q_JJ; details count the products with Q, one per point of the arc.

    Options
    -------
    max_iterations : limit on the Newton steps.
    """

    max_iterations: int = 1000

    def __post_init__(self) -> None:
        valid = self.max_iterations >= 1, "must be at least 1"
        require("projected-newton", vars(self), max_iterations=valid)

    def solved(self, ready: State, load: LoadCase, tolerance: float) -> Answer:
        point = _Point(*first_point(ready.start, load))
        newton = _Newton(ready.Q, load.p)
        limit = f"max_iterations = {self.max_iterations}"
        for k in range(self.max_iterations + 1):
            if k == self.max_iterations or point.residual <= rounding_of(load.p, point.y):
                break
            close = point.residual <= RESIDUAL_TARGET * tolerance
            following = newton.step(point)
            if following is None or (close and following.residual > point.residual / 2):
                limit = ""
                break
            point = following
        status, residual = kkt_status(ready.Q, load.p, point.lam, point.y, tolerance)
        return judged(status, point.lam, residual, {"products": newton.products}, limit, iterations=k)


class _Newton:
    """The steps of a load case. products : with Q."""

    def __init__(self, Q: Matrix, p: Vector) -> None:
        self.Q, self.p, self.diagonal, self.products = Q, p, np.diag(Q), 0

    def step(self, point: _Point) -> _Point | None:
        """The next point; None if there is none better."""
        lam, y = point.lam, point.y
        own = self.diagonal * lam
        w = float(abs(np.minimum(own, y)).max())
        bound = (own <= min(LARGEST_EPSILON, w)) & (y > 0)
        free, d = np.flatnonzero(~bound), -y / self.diagonal
        if free.size:
            block = self.Q.T[np.ix_(free, free)].T  # symmetric, and column-major as Q is
            factor = sla.cho_factor(block, lower=True, overwrite_a=True, check_finite=False)
            d[free] = sla.cho_solve(factor, -y[free], check_finite=False)
        slope, alpha = float(y[~bound] @ d[~bound]), 1.0
        while alpha >= SHORTEST:
            trial = np.maximum(lam + alpha * d, 0.0)
            self.products += 1
            following = _Point(trial, product(self.Q, trial) - self.p)
            step = trial - lam
            decrease = -float(step @ (y + following.y)) / 2
            wanted = DECREASE * (-alpha * slope - float(y[bound] @ step[bound]))
            if following.residual <= point.residual / 2 and alpha == 1.0:
                return following
            if decrease >= wanted > 0:
                return following
            alpha /= 2
        return None
