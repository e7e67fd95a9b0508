"""The iterations of the interior-point method on min ½λᵀQλ − pᵀλ, λ ≥ 0: Algorithm 3, and Mehrotra's.

With A = I the unknowns are λ, its slack w and the multiplier y = Qλ − p (the gaps). w = λ holds at
the start and is preserved by every step, so w is not stored.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.forms.product import product

from .newton_system import NewtonSystem

#: The most CG iterations per system, in units of m.
CG_LIMIT = 10


class CgExhausted(Exception):
    """The limit on CG iterations has been reached."""


@dataclass(frozen=True)
class Point:
    """λ, y and the gap Qλ − p, which y converges to: a y far larger must not hide it.

    The residual is s1 = −(Qλ − p − y), the duality gap μ = λᵀy/m.
    """

    lam: Vector
    y: Vector
    gap: Vector

    @property
    def s1(self) -> Vector:
        return self.y - self.gap

    @property
    def mu(self) -> float:
        return float(self.lam @ self.y) / len(self.lam)

    @property
    def infeasibility(self) -> float:
        """The larger of the overlap max(p − Qλ) and the force-weighted mean λᵀ|s1| / Σλ, mm.

        At an open gap λ → 0, and s1 does not matter as long as the gap stays open.
        """
        overlap = float((-self.gap).max())
        return max(overlap, float(self.lam @ abs(self.s1)) / float(self.lam.sum()))


@dataclass
class NewtonSteps:
    """Directions and steps for one load case, and the CG iterations that they took.

    theta : fraction of the step to the boundary, in (0, 1).
    """

    Q: Matrix
    p: Vector
    system: NewtonSystem
    theta: float
    cg_tolerance: float
    cg_left: float
    counts: dict[str, list[int]] = field(default_factory=lambda: {"predictor": [], "corrector": []})
    unconverged: int = 0

    def at(self, lam: Vector, y: Vector) -> Point:
        return Point(lam, y, product(self.Q, lam) - self.p)

    def direction(self, point: Point, s3: Vector, kind: str) -> tuple[Vector, Vector]:
        """(Δλ, Δy) of Algorithm 2, step 1, where (14) reads (Q + D) Δλ = s1 + Λ⁻¹s3 with D = YΛ⁻¹."""
        lam, y = point.lam, point.y
        limit = int(min(self.cg_left, CG_LIMIT * len(lam)))
        solved = self.system.solve(y / lam, point.s1 + s3 / lam, self.cg_tolerance, limit)
        self.counts[kind].append(solved.iterations)
        self.cg_left -= solved.iterations
        if self.cg_left <= 0:
            raise CgExhausted
        self.unconverged += not solved.converged
        return solved.v, (s3 - y * solved.v) / lam

    def step_length(self, point: Point, dlam: Vector, dy: Vector) -> float:
        """Algorithm 2, step 2: the largest α ≤ 1 with α ≤ θ (−v_i/Δv_i) wherever Δv_i < 0."""
        v, dv = np.concatenate([point.lam, point.y]), np.concatenate([dlam, dy])
        falling = dv < 0
        return min(1.0, self.theta * float(np.min(-v[falling] / dv[falling], initial=np.inf)))

    def moved(self, point: Point, dlam: Vector, dy: Vector) -> Point:
        """Algorithm 2, steps 2 to 4."""
        alpha = self.step_length(point, dlam, dy)
        return self.at(point.lam + alpha * dlam, point.y + alpha * dy)


def algorithm_3(newton: NewtonSteps, point: Point) -> Point:
    """The predictor step is taken; the corrector is a second Newton step, with its own matrix."""
    s3 = -point.lam * point.y
    predicted = newton.moved(point, *newton.direction(point, s3, "predictor"))  # step 5
    sigma = (predicted.mu / point.mu) ** 3
    s3 = sigma * predicted.mu - predicted.lam * predicted.y
    return newton.moved(predicted, *newton.direction(predicted, s3, "corrector"))  # step 6


def mehrotra(newton: NewtonSteps, point: Point) -> Point:
    """Predictor–corrector as in the textbooks: one matrix, two right-hand sides.

    The affine direction is not taken; it gives σ = (μ_aff/μ)³ and the second-order term of
    s3 = σμe − ΛYe − ΔΛ_aff ΔY_aff e. Source: Mehrotra, SIAM J. Optim. 2:575–601, 1992.
    """
    dlam, dy = newton.direction(point, -point.lam * point.y, "predictor")
    alpha = newton.step_length(point, dlam, dy)
    mu_affine = float((point.lam + alpha * dlam) @ (point.y + alpha * dy)) / len(dlam)
    sigma = (mu_affine / point.mu) ** 3
    s3 = sigma * point.mu - point.lam * point.y - dlam * dy
    return newton.moved(point, *newton.direction(point, s3, "corrector"))


#: The option `scheme`.
SCHEMES: dict[str, Callable[[NewtonSteps, Point], Point]] = {
    "algorithm_3": algorithm_3,
    "mehrotra": mehrotra,
}
