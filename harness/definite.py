"""A lower bound on the smallest eigenvalue of K that is proven, not estimated.

If a floating-point Cholesky factorisation of the rounded B = fl(K − sI) runs to completion, then
λmin(B) ≥ −c with c = γ_{n+1}/(1 − γ_{n+1}) · trace B, whatever the order of its sums (Rump, BIT
46:433–452, 2006), and so λmin(K) ≥ s − c − u max(B_ii). A blocked factorisation may multiply by the
reciprocal of a pivot where the theorem divides, one rounding more: γ_{2(n+1)} is taken in its place.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from problems.assembly import Matrix

from .exact_residual import U, gamma

SHARES = (0.9, 0.5, 0.1)  # of the estimate, tried in turn


def smallest_eigenvalue(K: Matrix, estimate: float) -> float:
    """A proven lower bound on λmin(K), K (n, n) symmetric; 0 where no positive one was found.

    estimate : of λmin; the better, the sharper the bound.
    """
    diagonal = np.diag(K)
    for share in SHARES:
        s = share * estimate
        B = np.array(K, order="F")
        B[np.diag_indices_from(B)] = diagonal - s
        trace = float(abs(diagonal - s).sum())
        largest = float(abs(diagonal - s).max())
        _, info = lapack.dpotrf(B, overwrite_a=True, clean=False)
        if info == 0:
            error = gamma(2 * (len(K) + 1))
            bound = s - 1.01 * (error / (1 - error) * trace + U * largest)
            if bound > 0:
                return bound
    return 0.0
