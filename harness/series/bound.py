"""A proven bound on the displacement error of a block of answers, in float64 but for one cut in `residual`.

x and λ ≥ 0 with C = {λ > 0} are the exact answer of another problem, f̃ = f − r and g̃ = g + δ, where

    r = f − Kx − Aλ,    s = g − Aᵀx,    δ_i = −s_i for i in C,    δ_i = max(−s_i, 0) else.

The answer is P(K⁻¹f), P the projection on {Aᵀx ≤ g} in the norm of K. It moves by at most ‖r‖_{K⁻¹} from f
to f̃. From g to g̃ the set is translated by any d with Aᵀd = δ, and P then moves by at most ‖d‖_K, because
I − P does not expand; d = A(AᵀA)⁻¹δ gives, with κ ≤ λmin(K), σ² ≤ λmin(AᵀA) and λmax(K) ≤ ‖K‖_∞,

    max|x − x*| ≤ ‖x − x*‖_K / √κ ≤ ( ‖r‖₂/√κ + ‖δ‖₂ √(‖K‖_∞/σ²) ) / √κ.

So the bound grows with the residual itself, where that of `certificate` grows with its square root, and
plain float64 for λ and s will do. Weakly active contacts are as good as others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from problems.assembly import Assembly, Matrix, Prepared, Vector

from ..definite import smallest_eigenvalue
from ..exact_residual import gamma
from ..reference import proven_lambda_min
from .residual import SAFE, Split


@dataclass(frozen=True)
class Bound:
    """κ (N/mm), ‖K‖_∞ (N/mm) and σ² of an assembly."""

    kappa: float
    stiffest: float
    sigma2: float

    @classmethod
    def of(cls, prepared: Prepared) -> Bound:
        """Once an assembly; κ comes from the cache where it stands there."""
        rows = [abs(K).sum(axis=0).max() for K in prepared.assembly.blocks]
        stiffest = SAFE * float(max(rows))
        return cls(proven_lambda_min(prepared), stiffest, independence(prepared.assembly))

    def bound(self, r: Matrix, error: Matrix, s: Matrix, s_error: Matrix, lam: Matrix) -> Vector:
        """(k,) mm for columns r (n, k), s (m, k), λ (m, k) ≥ 0; r and s known to within their errors."""
        if not (self.kappa > 0 and self.sigma2 > 0):
            return np.full(r.shape[1], np.inf)
        force = np.linalg.norm(abs(r) + error, axis=0)
        delta = np.where(lam > 0, abs(s) + s_error, np.maximum(s_error - s, 0.0))
        gap = np.linalg.norm(delta, axis=0) * np.sqrt(self.stiffest / self.sigma2)
        return SAFE * (force / np.sqrt(self.kappa) + gap) / np.sqrt(self.kappa)


def gaps(assembly: Assembly, g: Matrix, x: Split) -> tuple[Matrix, Matrix]:
    """s = g − Aᵀx (m, k) in mm, and a bound on its error."""
    A = assembly.A
    s = (g - A.T @ x.head) - A.T @ x.tail
    depth = 2 * int(np.diff(A.indptr).max(initial=0)) + 3
    size = abs(g) + abs(A).T @ (abs(x.head) + abs(x.tail))
    return s, SAFE * gamma(depth) * size


def independence(assembly: Assembly) -> float:
    """A proven σ² ≤ λmin(AᵀA); 0 where none was found. AᵀA falls apart into the contacts of a node each."""
    G = sp.csr_array(assembly.A.T @ assembly.A)
    count, label = connected_components(G, directed=False)
    sizes = np.bincount(label, minlength=count)
    groups = np.split(np.argsort(label, kind="stable"), np.cumsum(sizes)[:-1])
    least = float(G.diagonal()[sizes[label] == 1].min(initial=np.inf))
    for group in groups:
        if len(group) > 1:
            block = np.asfortranarray(G[group][:, group].toarray())
            least = min(least, smallest_eigenvalue(block, float(np.linalg.eigvalsh(block)[0])))
    # The entries of AᵀA are rounded themselves.
    doubt = SAFE * gamma(assembly.n) * float(G.diagonal().max(initial=0.0)) * int(sizes.max(initial=1))
    return max(least - doubt, 0.0)
