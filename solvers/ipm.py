"""The paper's primal–dual interior-point method on the dual form min ½λᵀQλ − pᵀλ, λ ≥ 0.

Algorithm 3 as printed: a full predictor step (σ = 0), then a second Newton system at the new point
with σ = (μᵖ/μ)³; so two matrices H an iteration. The systems are solved by conjugate gradients
preconditioned with V = U + √D (eq. 15), from the start of Algorithm 5.

With A = I the unknowns are λ, its slack w and the multiplier y = Qλ − p (the gaps). w = λ holds at
the start and every step keeps it, so w is not stored.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.linalg as sla

from problems.assembly import Matrix, Vector
from problems.errors import InputError

from .base import Answer, Form, Load, Problem, Solver, Status
from .conjugate_gradients import conjugate_gradients
from .preconditioner import CholeskyPlusRoot
from .start import NoStart, algorithm_5

STALLED = 10  # iterations without progress before the method gives up


@dataclass(frozen=True)
class _Point:
    """λ and y with the residual s1 = −(Qλ − p − y) and the gap μ = λᵀy/m."""

    lam: Vector
    y: Vector
    s1: Vector

    @property
    def mu(self) -> float:
        return float(self.lam @ self.y) / len(self.lam)

    @property
    def infeasibility(self) -> float:
        """The larger of the overlap max(p − Qλ) and the force-weighted mean λᵀ|s1| / Σλ, mm.

        Where a gap is open, λ → 0 and s1 is of no consequence while the gap stays open.
        """
        overlap = float((self.s1 - self.y).max())
        return max(overlap, float(self.lam @ abs(self.s1)) / float(self.lam.sum()))


class Ipm(Solver):
    """Primal–dual interior point, Algorithm 3, with PCG(V).

    Stops when μ = λᵀy/m ≤ ε_μ and max(max(p − Qλ), λᵀ|s1| / Σλ) ≤ feasibility with
    s1 = y − (Qλ − p). ε_μ, in N·mm, is the tolerance asked for; the paper tests μ alone, because it
    solves its systems exactly.

    Options
    -------
    theta : share of the step to the boundary, in (0, 1).
    cg_tolerance : ‖V⁻ᵀ(b − HΔλ)‖₂ ≤ cg_tolerance · ‖V⁻ᵀb‖₂ ends the conjugate gradients.
    feasibility : mm; what inexact systems may leave in y = Qλ − p.
    max_iterations : of Algorithm 3.
    """

    forms: ClassVar[tuple[Form, ...]] = ("dual",)

    def __init__(
        self,
        *,
        theta: float = 0.995,
        cg_tolerance: float = 1e-3,
        feasibility: float = 1e-10,
        max_iterations: int = 200,
    ) -> None:
        if not 0 < theta < 1:
            raise InputError.one("ipm", "theta", theta, "must lie in (0, 1)")
        if not 0 < cg_tolerance < 1:
            raise InputError.one("ipm", "cg_tolerance", cg_tolerance, "must lie in (0, 1)")
        if not feasibility > 0:
            raise InputError.one("ipm", "feasibility", feasibility, "must be positive, mm")
        if max_iterations < 1:
            raise InputError.one("ipm", "max_iterations", max_iterations, "must be at least 1")
        self.theta = theta
        self.cg_tolerance = cg_tolerance
        self.feasibility = feasibility
        self.max_iterations = max_iterations

    def prepare(self, data: Problem) -> tuple[Matrix, CholeskyPlusRoot]:
        """Q and the preconditioner on its Cholesky factor U."""
        Q = data.Q
        return Q, CholeskyPlusRoot(sla.cholesky(Q, check_finite=False))

    def solve(self, ready: tuple[Matrix, CholeskyPlusRoot], load: Load, tolerance: float) -> Answer:
        Q, V = ready
        try:
            lam, y = algorithm_5(Q, load.p)  # Algorithm 3, step 2
        except NoStart as error:
            return Answer("failed", None, iterations=0, details={"cause": str(error)})
        point = self._point(Q, load.p, lam, y)  # step 3
        counts: dict[str, list[int]] = {"predictor": [], "corrector": []}
        status: Status = "iteration_limit"
        cause = None
        smallest, stalled = np.inf, 0
        for _ in range(self.max_iterations):  # step 4
            if point.mu <= tolerance and point.infeasibility <= self.feasibility:
                status = "solved"
                break
            measure = max(point.mu / tolerance, point.infeasibility / self.feasibility)
            stalled = 0 if measure < smallest else stalled + 1
            smallest = min(smallest, measure)
            if stalled == STALLED:
                status, cause = "inaccurate", f"rounding: {smallest:.1e} × what was asked for, and no less"
                break
            mu = point.mu
            point = self._newton_step(Q, V, load.p, point, 0.0, counts["predictor"])  # step 5
            sigma = (point.mu / mu) ** 3
            point = self._newton_step(Q, V, load.p, point, sigma, counts["corrector"])  # step 6
            if not np.isfinite(point.mu):
                return Answer("failed", None, details={"cause": "λ or y is no longer finite"})
        details = {"cg": counts, "mu": point.mu, "infeasibility": point.infeasibility}
        return Answer(
            status,
            point.lam,
            iterations=len(counts["predictor"]),
            inner_iterations=sum(counts["predictor"]) + sum(counts["corrector"]),
            details=details | ({"cause": cause} if cause else {}),
        )

    def _newton_step(
        self, Q: Matrix, V: CholeskyPlusRoot, p: Vector, point: _Point, sigma: float, counts: list[int]
    ) -> _Point:
        """Algorithm 2 for the dual problem, where (14) reads (Q + D) Δλ = s1 + Λ⁻¹s3, D = YΛ⁻¹."""
        lam, y = point.lam, point.y
        s3 = sigma * point.mu - lam * y  # Algorithm 2, step 1
        V.update(y / lam)
        b = V.to_transformed(point.s1 + s3 / lam)
        cg = conjugate_gradients(V.multiply, b, self.cg_tolerance, 10 * len(lam))
        counts.append(cg.iterations)
        dlam = V.from_transformed(cg.z)
        dy = (s3 - y * dlam) / lam
        alpha = min(self._step(lam, dlam), self._step(y, dy))  # step 2
        return self._point(Q, p, lam + alpha * dlam, y + alpha * dy)  # steps 3 and 4

    def _step(self, v: Vector, dv: Vector) -> float:
        """The largest α ≤ 1 with α ≤ θ (−v_i/Δv_i) wherever Δv_i < 0."""
        falling = dv < 0
        return min(1.0, self.theta * float(np.min(-v[falling] / dv[falling], initial=np.inf)))

    @staticmethod
    def _point(Q: Matrix, p: Vector, lam: Vector, y: Vector) -> _Point:
        return _Point(lam, y, y - (Q @ lam - p))
