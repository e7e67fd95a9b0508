"""A proven bound on the displacement errors of a block of answers, in float64 but for `residual`'s split.

x and λ ≥ 0 with C = {λ > 0} are the exact answer of another problem, f̃ = f − r and g̃ = g + δ, where

    r = f − Kx − Aλ,    s = g − Aᵀx,    δ_i = −s_i for i in C,    δ_i = max(−s_i, 0) else.

The answer is P(K⁻¹f), P the projection onto {Aᵀx ≤ g} in the norm of K. From f to f̃ it moves by at most
‖r‖_{K⁻¹}. From g to g̃ the set is translated by any d with Aᵀd = δ, and P then moves by at most ‖d‖_K, because
I − P is nonexpansive. For any z such a d is z + A(AᵀA)⁻¹(δ − Aᵀz), the shortest for z = K⁻¹AQ⁻¹δ, so that,
with κ ≤ λmin(K), σ² ≤ λmin(AᵀA), λmax(K) ≤ ‖K‖_∞ and the largest compliance D ≥ max (K⁻¹)_ii,

    max|x − x*| ≤ √D ‖x − x*‖_K ≤ √D ( ‖r‖₂/√κ + ‖z‖_K + ‖δ − Aᵀz‖₂ √(‖K‖_∞/σ²) ).

So the bound is proportional to the residual, where that of `certificate` is to its square root, and plain
float64 suffices for λ and s. Weakly active contacts need no special treatment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from harness.verification.exact_residual import ETA, exponent, gamma
from harness.verification.independence import independence
from harness.verification.length import length
from harness.verification.reference import proven_lambda_min
from problems.forms.assembly import Assembly, Matrix, Vector
from problems.forms.prepared import Prepared

from .compliance import largest_compliance
from .residual import SAFE, Split


@dataclass(frozen=True)
class Bound:
    """κ (N/mm), ‖K‖_∞ (N/mm), σ² and D (mm/N) of an assembly, and the Cholesky factor of its Q."""

    prepared: Prepared
    kappa: float
    stiffest: float
    sigma2: float
    compliance: float
    factor: Matrix

    @classmethod
    def of(cls, prepared: Prepared) -> Bound:
        """Computed once per assembly; κ comes from the cache if it is there."""
        stiffest = SAFE * prepared.assembly.K.norm
        sigma2, kappa = independence(prepared.assembly), proven_lambda_min(prepared)
        D = largest_compliance(prepared, kappa)
        return cls(prepared, kappa, stiffest, sigma2, D, sla.cholesky(prepared.Q, check_finite=False))

    def bound(self, r: Matrix, error: Matrix, s: Matrix, s_error: Matrix, lam: Matrix) -> Vector:
        """(k,) mm for columns r (n, k), s (m, k), λ (m, k) ≥ 0; r and s known to within their errors."""
        if not (self.kappa > 0 and self.sigma2 > 0):
            return np.full(r.shape[1], np.inf)
        force = length(abs(r) + error)
        closed = lam > 0
        delta = np.where(closed, -s, np.maximum(-s, 0.0))
        uncertainty = np.where(closed | (s < s_error), s_error, 0.0)
        distance = self._translation(delta, length(uncertainty))
        bounds = SAFE * np.sqrt(self.compliance) * (force / np.sqrt(self.kappa) + distance)
        return np.where(np.isfinite(bounds), bounds, np.inf)

    def _translation(self, delta: Matrix, uncertainty: Vector) -> Vector:
        """(k,) ‖d‖_K of a d with Aᵀd = δ (m, k), δ uncertain by that much in its 2-norm."""
        assembly = self.prepared.assembly
        A, n = assembly.A, assembly.n
        z = self.prepared.assembly.K.solve(A @ sla.cho_solve((self.factor, False), delta, check_finite=False))
        scale = np.exp2(exponent(abs(z).max(axis=0, initial=0.0)))
        w = z / scale  # so that its squares do not underflow
        # |fl(wᵀKw) − wᵀKw| ≤ γ_2n |w|ᵀ|K||w| ≤ γ_2n ‖K‖_∞ ‖w‖², and η for each product that underflows
        energy = np.maximum((w * assembly.K.multiply(w)).sum(axis=0), 0.0)
        size = length(w)
        energy = energy + gamma(2 * n) * self.stiffest * size**2 + 2 * n * n * ETA * (size > 0)
        left = delta - A.T @ z
        depth = int(np.diff(A.indptr).max(initial=0)) + 2
        rounding = gamma(depth) * (abs(delta) + abs(A).T @ abs(z)) + depth * ETA
        missed = length(left) + length(rounding) + uncertainty
        return scale * np.sqrt(energy) + missed * np.sqrt(self.stiffest / self.sigma2)


def gaps(assembly: Assembly, g: Matrix, x: Split) -> tuple[Matrix, Matrix]:
    """s = g − Aᵀx (m, k) in mm, and a bound on its error."""
    A = assembly.A
    s = (g - A.T @ x.head) - A.T @ x.tail
    depth = 2 * int(np.diff(A.indptr).max(initial=0)) + 3
    x_size = abs(x.head) + abs(x.tail)
    error = gamma(depth) * (abs(g) + abs(A).T @ x_size) + depth * ETA
    return s, SAFE * error
