"""Modified proportioning with reduced gradient projections (MPRGP) for min ½λᵀQλ − pᵀλ, λ ≥ 0.

Z. Dostál and J. Schöberl, Comput. Optim. Appl. 30:23–43, 2005. With the face F = {λ > 0}, y = Qλ − p, the
diagonal D of Q and a B ≈ Q, the gradient is split into

    φ = y on F        φ̃ = min(φ, Dλ/ᾱ)        β = min(y, 0) off F

A point with βᵀD⁻¹β ≤ φ̃ᵀD⁻¹φ is proportional: F is then explored by conjugate gradients, preconditioned with
B_FF⁻¹; where their step leaves λ ≥ 0, it ends at the boundary and an expansion follows, the projection of the
free gradient. At any other point the step is a proportioning, which frees contacts with y < 0.

A projection d minimises yᵀd + ½dᵀBd over λ + d ≥ 0, with

    B = diag(Q)/ᾱ    d = max(λ − ᾱ y/diag(Q), 0) − λ, of Dostál only on the face, or only off it
    B = M⁻¹          by block principal pivoting with band factorisations, on all contacts

It is taken in full if that decreases the objective, −yᵀd/dᵀQd > ½, else up to the minimum along it, as is one
that only frees contacts. For B = M⁻¹ the preconditioner on a face, N the other contacts, is

    (M⁻¹)_FF⁻¹ = M_FF − M_FN M_NN⁻¹ M_NF,

two band products and a band solution.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from problems.forms.assembly import Mask, Vector
from problems.forms.compliance import Compliance
from solvers.kkt import is_small, kkt_errors, kkt_residual, rounding_bound

from .block_pivoting import TrialSolution, block_pivoting
from .contact_sets import OpenFactor, banded_set

RESIDUAL_TARGET = 0.1  # of the tolerance
RECOMPUTED = 50  # steps after which y is recomputed from λ
STALLED = 5  # recomputations that have not halved the KKT residual: the rest is rounding
STEP_LENGTH = 1.9  # ᾱ λmax: below 2 every projection decreases the objective
POWER_STEPS = 30  # products for λmax, once per assembly
MAX_SETS = 200  # contact sets per projection with M


@dataclass
class Diagonal:
    """B = diag(Q)/ᾱ. diagonal : of Q. alpha : ᾱ = 1.9/λmax(diag(Q)⁻¹Q). sets : contact sets tried
    in this load case."""

    diagonal: Vector
    alpha: float
    sets: int = field(default=0, init=False)

    def precondition(self, F: Mask, r: Vector) -> Vector:
        """B_FF⁻¹ r_F, zero off F."""
        return np.where(F, r, 0.0) / self.diagonal

    def projection(self, lam: Vector, y: Vector, expanding: bool) -> Vector:
        """d with λ + d ≥ 0. expanding : whether the face is to shrink, or else to grow."""
        part = np.where(lam > 0, y if expanding else 0.0, 0.0 if expanding else np.minimum(y, 0.0))
        step: Vector = np.maximum(lam - self.alpha * part / self.diagonal, 0.0) - lam
        return step


@dataclass
class Face(Diagonal):
    """B of `Diagonal`, but M⁻¹ in the preconditioner. factor : of M off the face."""

    factor: OpenFactor

    def precondition(self, F: Mask, r: Vector) -> Vector:
        M = self.factor.M
        v = M.product(np.where(F, r, 0.0)[M.order])
        z = np.empty_like(r)
        z[M.order] = v - M.product(self.factor(~F[M.order]).solve(v))
        z[~F] = 0.0
        return z


class Band(Face):
    """B = M⁻¹, ᾱ = 1."""

    def projection(self, lam: Vector, y: Vector, expanding: bool) -> Vector:
        order = self.factor.M.order
        force, gap, compliance = lam[order], y[order], self.diagonal[order]
        C = np.where(force > 0, compliance * force > gap, gap < 0)
        start = TrialSolution(force, gap, float(abs(gap[force > 0]).max(initial=0.0)))
        result = block_pivoting(partial(banded_set, self.factor, start), C, compliance, 0.0, MAX_SETS)
        self.sets += result.passes
        d = np.empty_like(lam)
        d[order] = np.maximum(result.trial.lam, 0.0) - force
        return d


@dataclass
class Proportioning:
    """A load case: λ (m,) N and y = Qλ − p (m,) mm.

    gaps : computes y from λ. products : with Q. last_step : the last conjugate direction, Q times it, and its
    face.
    """

    Q: Compliance
    p: Vector
    diagonal: Vector
    metric: Diagonal
    gaps: Callable[[Vector], Vector]
    lam: Vector
    y: Vector
    products: int = 0
    steps: dict[str, int] = field(default_factory=lambda: {"cg": 0, "expansion": 0, "proportioning": 0})
    last_step: tuple[Vector, Vector, Mask] | None = None

    def solve(self, tolerance: float, max_products: int, log: Callable[..., None]) -> bool:
        """Steps until the KKT errors are at most max(tolerance/10, rounding) mm or rounding prevents more.

        False if `max_products` were not enough. λ and y then have the smallest residual that was recomputed.
        log : takes the figures of each recomputation.
        """
        best, since, stalled = (np.inf, self.lam, self.y), 0, 0
        while True:
            enough = self.products >= max_products
            moved = not enough and not self.is_optimal(RESIDUAL_TARGET * tolerance) and self._step()
            since += 1
            if moved and since < RECOMPUTED:
                continue
            self.y, self.last_step, since = self.gaps(self.lam), None, 0
            self.products += 1
            residual = kkt_residual(self.lam, self.y)
            log(products=self.products, residual_mm=residual)
            stalled = 0 if moved or residual < best[0] / 2 else stalled + 1
            best = min(best, (residual, self.lam, self.y), key=lambda point: point[0])
            done = stalled == STALLED or (stalled and residual <= tolerance)
            done = done or self.is_optimal(RESIDUAL_TARGET * tolerance)
            if enough or done:
                _, self.lam, self.y = best
                return bool(done)

    def is_optimal(self, tolerance: float) -> bool:
        """Whether no error of λ and y is beyond the tolerance, mm, and its contact's rounding."""
        rounding = rounding_bound(self.diagonal, self.p, self.lam)
        return is_small(kkt_errors(self.lam, self.y), tolerance, rounding)

    def _step(self) -> bool:
        """Take a step; False if rounding lets no direction decrease the objective."""
        F = self.lam > 0
        proportional = self._is_proportional(F)
        if proportional and self._conjugate_gradients(F):
            self.steps["cg"] += 1
            return True
        self.last_step = None
        self.steps["expansion" if proportional else "proportioning"] += 1
        return self._project(self.metric.projection(self.lam, self.y, proportional))

    def _is_proportional(self, F: Mask) -> bool:
        free, chopped = self.y[F], np.minimum(self.y[~F], 0.0)
        reduced = np.minimum(free, self.diagonal[F] * self.lam[F] / self.metric.alpha)
        return bool(chopped @ (chopped / self.diagonal[~F]) <= reduced @ (free / self.diagonal[F]))

    def _conjugate_gradients(self, F: Mask) -> bool:
        """A step on the face; False if it had to end at the boundary."""
        d = -self.metric.precondition(F, self.y)
        if self.last_step is not None and not (self.last_step[2] ^ F).any():
            last, change, _ = self.last_step
            d -= (d @ change) / (last @ change) * last
        change = self._times_Q(d)
        slope, curvature = float(self.y @ d), float(d @ change)
        if not (slope < 0 < curvature):
            return False
        shrinking = np.flatnonzero(d < 0)
        ratios = self.lam[shrinking] / -d[shrinking]
        length = min(-slope / curvature, float(ratios.min(initial=np.inf)))
        inside = length == -slope / curvature
        lam = np.maximum(self.lam + length * d, 0.0)
        if not inside:
            lam[shrinking[ratios.argmin()]] = 0.0
        self.lam, self.y = lam, self.y + length * change
        self.last_step = d, change, F
        return inside

    def _project(self, d: Vector) -> bool:
        slope = float(self.y @ d)
        if not slope < 0:
            return False
        change = self._times_Q(d)
        curvature = float(d @ change)
        length = -slope / curvature if curvature > 0 else 1.0
        if length > 1 / 2 and (d < 0).any():
            length = 1.0
        self.lam, self.y = np.maximum(self.lam + length * d, 0.0), self.y + length * change
        return True

    def _times_Q(self, v: Vector) -> Vector:
        self.products += 1
        return self.Q @ v


def step_length(Q: Compliance, diagonal: Vector) -> float:
    """ᾱ of `Diagonal`, with λmax by the power method, in `POWER_STEPS` products."""
    root = np.sqrt(diagonal)
    v, largest = np.random.default_rng(0).uniform(0.5, 1.5, len(root)), 1.0
    for _ in range(POWER_STEPS):
        v /= np.linalg.norm(v)
        v = (Q @ (v / root)) / root
        largest = float(np.linalg.norm(v))
    return STEP_LENGTH / largest
