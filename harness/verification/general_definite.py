"""A proven lower bound on λmin of a sparse K without a narrow band, from its LU factors without pivoting.

With B = fl(K − sI) after a symmetric permutation, the computed factors satisfy |B − LU| ≤ γ_{c+1} |L||U|,
entry by entry and whatever the order of the sums, of which none has more terms than c, the number of entries
in the longest column of U (Higham, Accuracy and Stability of Numerical Algorithms, 2002, theorem 9.3;
γ_{2(c+2)} is used, for multiplications by the reciprocal of a pivot). With D = diag(U) > 0 and F = U − DLᵀ,
zero but for rounding,

    B = LDLᵀ + (B − LU) + LF,        λmin(K) ≥ s − γ ‖|L||U|‖₂ − ‖|L||F|‖₂ − u max(|B_ii|),

as LDLᵀ is positive definite. Both norms are at most √(‖·‖₁‖·‖_∞), by products with a vector of ones.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.forms.sparse_factor import GeneralFactor, NotPositiveDefinite

from .definite import SMALLEST
from .exact_residual import U as ROUNDING
from .exact_residual import gamma

SAFE = 1.01  # for the rounding of the bound itself


def shifted_bound(K: sp.csc_array, s: float) -> float:
    """A proven lower bound on λmin(K), K (N, N) symmetric, from a factorisation of K − sI; 0 if it fails."""
    shifted = sp.csc_array(K - s * sp.eye_array(K.shape[0]))
    largest = float(abs(shifted.diagonal()).max())
    try:
        lu = GeneralFactor(shifted).lu
    except NotPositiveDefinite:
        return 0.0
    L, U = lu.L, lu.U
    pivots = U.diagonal()
    if not ((pivots > 0).all() and np.isfinite(U.data).all() and np.isfinite(L.data).all()):
        return 0.0
    longest = int(np.diff(U.indptr).max())
    product = sp.csc_array((L @ sp.diags_array(pivots)).T)
    F = abs(U - product) + ROUNDING * abs(product)
    for M in (L, U):
        np.abs(M.data, out=M.data)
    away = gamma(2 * (longest + 2)) * _norm(L, U) + _norm(L, F) + ROUNDING * (largest + abs(s))
    bound = s - SAFE * away
    return float(bound) if bound >= SMALLEST else 0.0


def _norm(P: Any, R: Any) -> float:
    """‖PR‖₂ or more, for P, R ≥ 0, but for a relative rounding."""
    ones = np.ones(P.shape[0])
    return float(np.sqrt((P @ (R @ ones)).max() * (R.T @ (P.T @ ones)).max()))
