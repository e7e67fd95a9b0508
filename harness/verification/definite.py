"""A proven lower bound on the smallest eigenvalue of DKD, from a factorisation of DKD − sI.

If a floating-point Cholesky factorisation of the rounded B = fl(DKD − sI) runs to completion, its factor R
satisfies |RᵀR − B| ≤ γ_{c+1} |R|ᵀ|R|, entry by entry and whatever the order of its sums, of which none has more
than c terms: c = n, or b + 1 in a band of half-width b (Higham, Accuracy and Stability of Numerical Algorithms,
2002, theorem 10.3). So

    λmin(DKD) ≥ s − γ_{c+1} ‖|R|ᵀ|R|‖₂ − u max(|B_ii| + s),

γ_{2(c+1)} being used, as a blocked factorisation may multiply by the reciprocal of a pivot where the theorem
divides. The norm is at most max (|R|ᵀ|R|v)_i/v_i for any v > 0 (Collatz and Wielandt).

Without a narrow band, the LU factors of SuperLU without pivoting have |B − LU| ≤ γ_{c+1} |L||U| (ibid., theorem
9.3), and with Δ = diag(U) > 0 and F = U − ΔLᵀ, zero but for rounding, B = LΔLᵀ + (B − LU) + LF, LΔLᵀ ≻ 0:

    λmin(DKD) ≥ s − γ ‖|L||U|‖₂ − ‖|L||F|‖₂ − u max(|B_ii| + s).

D is made of powers of two, so that DKD is exact. An eigenvalue below 2⁻¹⁰⁰⁰ counts as none: above, what
underflows in the factorisation, some n²η with η = 2⁻¹⁰⁷⁴, is within the margin's last 1 %.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg import blas, lapack

from problems.forms.assembly import Matrix, Vector
from problems.forms.balance import least_eigenvalue
from problems.forms.sparse_factor import (
    Factor,
    GeneralFactor,
    NotPositiveDefinite,
    Renumbered,
    factored,
    lower_band,
)

from .enclosure import SAFE, U, gamma

SHARES = (0.5, 0.1, 0.01)  # of the estimate, tried in turn
STEPS = 5  # of the power method, for v
SMALLEST = 2.0**-1000


def smallest_eigenvalue(
    K: Any, estimate: float, D: Vector | None = None, factor: Factor | None = None
) -> float:
    """κ ≤ λmin(DKD), proven, K (n, n) symmetric, dense or sparse; 0 if no positive κ was found.

    estimate : of λmin(DKD); the better it is, the sharper the bound. factor : of a sparse K.
    """
    K = _in_units(K, D)
    if isinstance(factor, Renumbered):
        K = sp.csc_array(K[factor.order][:, factor.order])
    for share in SHARES:
        s = share * estimate
        if not sp.issparse(K):
            away = _of_dense(K, s)
        else:
            away = _of_general(K, s) if isinstance(factor, GeneralFactor) else _of_band(K, s)
        largest = float(abs(K.diagonal() - s).max(initial=0.0))
        bound = s - SAFE * (away + U * (largest + abs(s)))
        if bound >= SMALLEST:
            return float(bound)
    return 0.0


def independence(A: sp.csc_array) -> float:
    """A proven σ² ≤ λmin(AᵀA), how independent the contacts are; 0 if none was found.

    The entries of AᵀA are rounded by γ_c (|A|ᵀ|A|), c the longest column.
    """
    if A.shape[1] == 0:
        return np.inf
    G, size = sp.csc_array(A.T @ A), abs(A)
    try:
        factor = factored(G)
    except NotPositiveDefinite:
        return 0.0
    longest = int(np.diff(sp.csc_array(A).indptr).max())
    rounding = SAFE * gamma(longest + 1) * float((size.T @ (size @ np.ones(A.shape[1]))).max())
    sigma2 = smallest_eigenvalue(G, least_eigenvalue(factor.solve, np.ones(A.shape[1])), None, factor)
    return sigma2 - rounding if sigma2 - rounding >= SMALLEST else 0.0


def _in_units(K: Any, D: Vector | None) -> Any:
    if D is None:
        return K
    if not sp.issparse(K):
        return np.asfortranarray(K * D * D[:, None])
    values = K.data * D[K.indices] * np.repeat(D, np.diff(K.indptr))
    return sp.csc_array((values, K.indices, K.indptr), shape=K.shape)


def _of_dense(K: Matrix, s: float) -> float:
    """γ ‖|R|ᵀ|R|‖₂; infinite if the factorisation stops."""
    B = np.array(K, order="F")
    B[np.diag_indices_from(B)] -= s
    R, info = lapack.dpotrf(B, overwrite_a=True, clean=False)
    np.abs(R, out=R)
    v, least = np.ones(len(R)), np.inf
    for _ in range(STEPS if info == 0 else 0):
        w = blas.dtrmv(R, blas.dtrmv(R, v), trans=1)
        least = min(least, float((w / v).max()))
        v = w / w.max()
    return gamma(2 * (len(K) + 1)) * least


def _of_band(K: sp.csc_array, s: float) -> float:
    """γ ‖|L||L|ᵀ‖_∞."""
    band = lower_band(K)
    band[0] -= s
    L, info = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
    if info:
        return np.inf
    np.abs(L, out=L)
    width, v = len(L) - 1, np.ones(L.shape[1])
    norm = blas.dtbmv(width, L, blas.dtbmv(width, L, v, lower=1, trans=1), lower=1).max()
    return gamma(2 * (len(L) + 1)) * float(norm)


def _of_general(K: sp.csc_array, s: float) -> float:
    """γ ‖|L||U|‖₂ + ‖|L||F|‖₂."""
    try:
        lu = GeneralFactor(sp.csc_array(K - s * sp.eye_array(K.shape[0]))).lu
    except NotPositiveDefinite:
        return np.inf
    L, R = lu.L, lu.U
    pivots = R.diagonal()
    if not ((pivots > 0).all() and np.isfinite(R.data).all() and np.isfinite(L.data).all()):
        return np.inf
    product = sp.csc_array((L @ sp.diags_array(pivots)).T)
    F = abs(R - product) + U * abs(product)
    longest = int(np.diff(R.indptr).max())
    return gamma(2 * (longest + 2)) * _norm(abs(L), abs(R)) + _norm(abs(L), F)


def _norm(P: Any, R: Any) -> float:
    """‖PR‖₂ ≤ √(‖PR‖₁ ‖PR‖_∞), for P, R ≥ 0, but for a relative rounding."""
    ones = np.ones(P.shape[0])
    return float(np.sqrt((P @ (R @ ones)).max() * (R.T @ (P.T @ ones)).max()))
