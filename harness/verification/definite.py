"""A proven lower bound on the smallest eigenvalue of K.

If a floating-point Cholesky factorisation of the rounded B = fl(K − sI) runs to completion, its factor R
satisfies |RᵀR − B| ≤ γ_{n+1} |R|ᵀ|R|, entry by entry and whatever the order of its sums (Higham, Accuracy and
Stability of Numerical Algorithms, 2002, theorem 10.3), so that λmin(B) ≥ −γ_{n+1} ‖|R|ᵀ|R|‖₂ and
λmin(K) ≥ s − γ_{n+1} ‖|R|ᵀ|R|‖₂ − u max(B_ii). Computing this difference loses up to us more. A blocked
factorisation may multiply by the reciprocal of a pivot where the theorem divides, one more rounding:
γ_{2(n+1)} is used instead. The norm is at most max (|R|ᵀ|R|v)_i/v_i for any v > 0 (Collatz and Wielandt):
about 3 λmax for plates, a thousandth of the trace at n = 24080.

An eigenvalue below 2⁻¹⁰⁰⁰ counts as none: above, what underflows in the factorisation, some n²η with
η = 2⁻¹⁰⁷⁴, is within the margin's last 1 %.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import blas, lapack

from problems.forms.assembly import Matrix

from .exact_residual import U, gamma

SHARES = (0.9, 0.5, 0.1)  # of the estimate, tried in turn
STEPS = 5  # of the power method, for v
SMALLEST = 2.0**-1000


def smallest_eigenvalue(K: Matrix, estimate: float) -> float:
    """A proven lower bound on λmin(K), K (n, n) symmetric; 0 if no positive one was found.

    estimate : of λmin; the better it is, the sharper the bound.
    """
    diagonal = np.diag(K)
    for share in SHARES:
        s = share * estimate
        B = np.array(K, order="F")
        B[np.diag_indices_from(B)] = diagonal - s
        largest = float(abs(diagonal - s).max())
        R, info = lapack.dpotrf(B, overwrite_a=True, clean=False)
        if info == 0:
            bound = s - 1.01 * (gamma(2 * (len(K) + 1)) * _norm(R) + U * (largest + abs(s)))
            if bound >= SMALLEST:
                return bound
    return 0.0


def _norm(R: Matrix) -> float:
    """Upper bound on ‖|R|ᵀ|R|‖₂, up to a relative rounding of 2nu; overwrites R, in the upper triangle."""
    np.abs(R, out=R)
    v, least = np.ones(len(R)), np.inf
    for _ in range(STEPS):
        w = blas.dtrmv(R, blas.dtrmv(R, v), trans=1)
        least = min(least, float((w / v).max()))
        v = w / w.max()
    return least
