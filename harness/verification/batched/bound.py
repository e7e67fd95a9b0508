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
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from harness.verification.definite import smallest_eigenvalue
from harness.verification.exact_residual import gamma
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
        stiffest = SAFE * max(float(abs(K).sum(axis=0).max()) for K in prepared.assembly.blocks)
        sigma2, kappa = independence(prepared.assembly), proven_lambda_min(prepared)
        D = largest_compliance(prepared, kappa)
        return cls(prepared, kappa, stiffest, sigma2, D, sla.cholesky(prepared.Q, check_finite=False))

    def bound(self, r: Matrix, error: Matrix, s: Matrix, s_error: Matrix, lam: Matrix) -> Vector:
        """(k,) mm for columns r (n, k), s (m, k), λ (m, k) ≥ 0; r and s known to within their errors."""
        if not (self.kappa > 0 and self.sigma2 > 0):
            return np.full(r.shape[1], np.inf)
        force = np.linalg.norm(abs(r) + error, axis=0)
        closed = lam > 0
        delta = np.where(closed, -s, np.maximum(-s, 0.0))
        uncertainty = np.where(closed | (s < s_error), s_error, 0.0)
        distance = self._translation(delta, np.linalg.norm(uncertainty, axis=0))
        return SAFE * np.sqrt(self.compliance) * (force / np.sqrt(self.kappa) + distance)

    def _translation(self, delta: Matrix, uncertainty: Vector) -> Vector:
        """(k,) ‖d‖_K of a d with Aᵀd = δ (m, k), δ uncertain by that much in its 2-norm."""
        assembly = self.prepared.assembly
        A, n = assembly.A, assembly.n
        z = self.prepared.solve_K(A @ sla.cho_solve((self.factor, False), delta, check_finite=False))
        length = np.linalg.norm(z, axis=0)
        # |fl(zᵀKz) − zᵀKz| ≤ γ_2n |z|ᵀ|K||z| ≤ γ_2n ‖K‖_∞ ‖z‖²
        energy = (
            np.maximum((z * assembly.multiply_K(z)).sum(axis=0), 0.0)
            + gamma(2 * n) * self.stiffest * length**2
        )
        left = delta - A.T @ z
        depth = int(np.diff(A.indptr).max(initial=0)) + 2
        rounding = np.linalg.norm(gamma(depth) * (abs(delta) + abs(A).T @ abs(z)), axis=0)
        return np.sqrt(energy) + (np.linalg.norm(left, axis=0) + rounding + uncertainty) * np.sqrt(
            self.stiffest / self.sigma2
        )


def gaps(assembly: Assembly, g: Matrix, x: Split) -> tuple[Matrix, Matrix]:
    """s = g − Aᵀx (m, k) in mm, and a bound on its error."""
    A = assembly.A
    s = (g - A.T @ x.head) - A.T @ x.tail
    depth = 2 * int(np.diff(A.indptr).max(initial=0)) + 3
    size = abs(g) + abs(A).T @ (abs(x.head) + abs(x.tail))
    return s, SAFE * gamma(depth) * size


def independence(assembly: Assembly) -> float:
    """A proven σ² ≤ λmin(AᵀA); 0 if none was found. AᵀA is block diagonal, a block per node."""
    G = sp.csr_array(assembly.A.T @ assembly.A)
    count, label = connected_components(G, directed=False)
    sizes = np.bincount(label, minlength=count)
    groups = np.split(np.argsort(label, kind="stable"), np.cumsum(sizes)[:-1])
    least = float(G.diagonal()[sizes[label] == 1].min(initial=np.inf))
    for group in groups:
        if len(group) > 1:
            block = np.asfortranarray(G[group][:, group].toarray())
            least = min(least, smallest_eigenvalue(block, float(np.linalg.eigvalsh(block)[0])))
    # The entries of AᵀA are themselves rounded.
    uncertainty = SAFE * gamma(assembly.n) * float(G.diagonal().max(initial=0.0)) * int(sizes.max(initial=1))
    return max(least - uncertainty, 0.0)
