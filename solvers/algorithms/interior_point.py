"""Interior-point steps and starts for min ½λᵀQλ − pᵀλ, λ ≥ 0: Algorithm 3 and Mehrotra's.

With A = I the unknowns are λ, its slack w and the multiplier y = Qλ − p (the gaps). w = λ holds at the start
and is preserved by every step, so w is not stored. The residual is s1 = y − (Qλ − p).

Sufficiently large contact forces open every gap: λ > 0 with y = Qλ − p > 0. Algorithm 4 finds them from
displacements, Algorithm 5 from Q; with Q = AᵀK⁻¹A the points are the same. The other starts are infeasible.
STP1 and STP2 are those of D'Apuzzo, De Simone and di Serafino (Optim. Lett. 4:131–146, 2010), whose text was
not available: they follow a secondary source, the interior-point code of Project Chrono, and its parameters.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.forms.compliance import Compliance
from problems.forms.prepared import Prepared
from problems.stiffness.dense_block import product

from .newton_system import Direct, NewtonSystem

#: The most CG iterations per system, in units of m.
CG_LIMIT = 10
MULTIPLIER = 2.0  # the multiplier of λ, > 1
MAX_STEPS = 200  # multiplications, and sweeps of corrections


class CgExhausted(Exception):
    """The limit on CG iterations has been reached."""


@dataclass(frozen=True)
class Point:
    """λ, y and the gap Qλ − p, to which y converges. Residual s1 = y − gap, duality gap μ = λᵀy/m."""

    lam: Vector
    y: Vector
    gap: Vector

    @property
    def s1(self) -> Vector:
        return self.y - self.gap

    @property
    def mu(self) -> float:
        return float(self.lam @ self.y) / len(self.lam)

    def infeasibility(self, unit: float | Vector = 1.0) -> float:
        """The larger of the overlap max(p − Qλ) and the force-weighted mean λᵀ|s1| / Σλ, in mm or units (m,).

        At an open gap λ → 0, and s1 does not matter as long as the gap stays open.
        """
        overlap = float((-self.gap / unit).max())
        return max(overlap, float(self.lam @ (abs(self.s1) / unit)) / float(self.lam.sum()))


@dataclass
class NewtonSteps:
    """Directions and steps for one load case, and the CG iterations that they took.

    theta : fraction of the step to the boundary, in (0, 1).
    """

    Q: Compliance
    p: Vector
    system: NewtonSystem
    theta: float
    cg_tolerance: float
    cg_left: float
    counts: dict[str, list[int]] = field(default_factory=lambda: {"predictor": [], "corrector": []})
    unconverged: int = 0

    def at(self, lam: Vector, y: Vector) -> Point:
        return Point(lam, y, self.Q @ lam - self.p)

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


class NoStart(np.linalg.LinAlgError):
    """No feasible starting point was found."""


@dataclass(frozen=True)
class Start:
    """λ (N) and y (mm), (m,); the numbers of corrections, below eq. (16), and of multiplications."""

    lam: Vector
    y: Vector
    corrections: int = 0
    multiplications: int = 0


def algorithm_5(Q: Matrix, p: Vector) -> Start:
    """λ = e (1 N), corrected until Qλ > 0 (16), then multiplied until y = Qλ − p ≥ 0.

    One more multiplication follows, because the interior needs y > 0: mult·Qλ − p > Qλ − p ≥ 0. Raises
    NoStart if no λ > 0 with Qλ > 0 is found.
    """
    return _opened(lambda lam: Q @ lam, p)


def algorithm_4(prepared: Prepared, load: LoadCase) -> Start:
    """The start of `algorithm_5` from displacements: Kx = f − Aλ (step 3), y = g − Aᵀx (step 4)."""
    A, K = prepared.assembly.A, prepared.assembly.K
    return _opened(lambda lam: A.T @ K.solve(A @ lam), prepared.overlap(load))


def _opened(response: Callable[[Vector], Vector], p: Vector) -> Start:
    """The start that multiplying λ opens. response : Q times a vector."""
    lam, Qlam, corrections = _positive_response(response, np.ones(len(p)))  # step 1
    for multiplications in range(1, MAX_STEPS + 1):  # step 2
        y = Qlam - p  # step 3
        opened = bool((y >= 0).all())  # step 4
        lam, Qlam = MULTIPLIER * lam, MULTIPLIER * Qlam  # step 7, and the margin
        if opened:
            return Start(lam, Qlam - p, corrections, multiplications)  # steps 9 and 10, with w = λ
    raise NoStart(
        f"no starting point: y = Qλ − p still has a negative entry after {MAX_STEPS} multiplications"
    )


def _positive_response(response: Callable[[Vector], Vector], lam: Vector) -> tuple[Vector, Vector, int]:
    """A λ > 0 with Qλ > 0: the correction λ_i ← −Σ_{j≠i} q_ij λ_j / q_ii + ε below (16), ε the first λ_i."""
    corrections, epsilon = 0, lam.copy()
    for _ in range(MAX_STEPS):
        Qlam = response(lam)
        negative = np.flatnonzero(Qlam <= 0)
        if not negative.size:
            return lam, Qlam, corrections
        for i in negative:
            q = response((np.arange(len(lam)) == i).astype(float))
            others = q @ lam - q[i] * lam[i]
            lam[i] = max(lam[i], -others / q[i] + epsilon[i])
            corrections += 1
    raise NoStart(f"no starting point: no λ > 0 with Qλ > 0 found in {MAX_STEPS} sweeps of corrections")


def stp1(Q: Matrix, p: Vector, rho: float) -> Start:
    """λ = y = e, scaled once by r/(ρ·gap) if r = ‖s1‖₂ exceeds ρ·gap, gap = λᵀy = m."""
    return _scaled(Q, p, np.ones(len(p)), np.ones(len(p)), rho)


def stp2(Q: Matrix, p: Vector, rho: float, epsilon: float) -> Start:
    """From x = K⁻¹f: y_i = max((g − Aᵀx)_i, ε) = max(−p_i, ε) and λ_i = 1/y_i; then scaled as STP1.

    (From λ = e instead of x, as in the secondary source, it would coincide with STP1 on this form; it does
    so anyway if ε exceeds all gaps, as the source's ε = 1 does here.)
    """
    y = np.maximum(-p, epsilon)
    return _scaled(Q, p, 1.0 / y, y, rho)


def _scaled(Q: Matrix, p: Vector, lam: Vector, y: Vector, rho: float) -> Start:
    r = float(np.linalg.norm(y - (product(Q, lam) - p)))
    gap = float(lam @ y)
    scale = max(1.0, r / (rho * gap))
    return Start(scale * lam, scale * y)


def mehrotra_start(Q: Matrix, p: Vector) -> Start:
    """One affine step from a point of the data's magnitude: λ = max(λ̄, |λ̄ + Δλ|), y = max(ȳ, |ȳ + Δy|).

    ȳ = max|p| e in mm and λ̄ = ȳ m / trace Q in N. This form is from Nocedal and Wright,
    Numerical Optimization, 2nd ed., section 16.6, where the smallest values are 1.
    """
    y_bar = np.full(len(p), float(abs(p).max()) or 1.0)
    lam_bar = y_bar * len(p) / float(np.trace(Q))
    # The affine step of Algorithm 2 with σ = 0: (Q + D) Δλ = −(Qλ̄ − p), D = ȳ/λ̄, Δy = −ȳ − dΔλ.
    D = y_bar / lam_bar
    dlam = Direct(Q).solve(D, p - Q @ lam_bar, tolerance=0.0, limit=0).v
    dy = -y_bar - D * dlam
    return Start(np.maximum(lam_bar, abs(lam_bar + dlam)), np.maximum(y_bar, abs(y_bar + dy)))
