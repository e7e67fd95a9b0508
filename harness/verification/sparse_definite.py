"""A proven lower bound on the smallest eigenvalue of a sparse K in balanced units.

DKD has the digits of K and a diagonal between 1/2 and 2 (see problems.forms.balance). As in `definite`, a
Cholesky factorisation of fl(DKD − sI) that runs to completion proves λmin(DKD) ≥ s − γ_{2(b+2)} ‖|R|ᵀ|R|‖₂ …,
where no sum has more than b + 1 terms in a band of half-width b (Higham 2002, theorem 10.3). A K without a
narrow band is factored as it is for the solutions (see `general_definite`).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.linalg import blas, lapack

from problems.forms.assembly import Matrix, Vector
from problems.forms.balance import least_eigenvalue
from problems.forms.sparse_factor import GeneralFactor, Renumbered, lower_band
from problems.forms.sparse_prepared import SparsePrepared

from .definite import SMALLEST
from .exact_residual import U, gamma
from .general_definite import shifted_bound

SHARES = (0.5, 0.1, 0.01)  # of the estimate, tried in turn


def smallest_eigenvalue(prepared: SparsePrepared, D: Vector) -> float:
    """κ ≤ λmin(DKD), proven; 0 if no positive one was found."""
    assembly, least = prepared.assembly, np.inf
    for k, (K, rows) in enumerate(zip(assembly.blocks, assembly.slices, strict=True)):
        d = D[rows]
        K = sp.csc_array(K)
        values = K.data * d[K.indices] * np.repeat(d, np.diff(K.indptr))  # exact
        scaled = sp.csc_array((values, K.indices, K.indptr), shape=K.shape, copy=True)
        factor = prepared.sparse_factors[k]
        estimate = least_eigenvalue(factor.solve, d)
        if isinstance(factor, GeneralFactor):
            bounds = (shifted_bound(scaled, share * estimate) for share in SHARES)
            least = min(least, next((bound for bound in bounds if bound > 0), 0.0))
            continue
        if isinstance(factor, Renumbered):
            scaled = sp.csc_array(scaled[factor.order][:, factor.order])
        least = min(least, _of_band(scaled, estimate))
    return float(least)


def _of_band(K: sp.csc_array, estimate: float) -> float:
    for share in SHARES:
        s = share * estimate
        shifted = lower_band(K)
        shifted[0] -= s
        largest = float(abs(shifted[0]).max())
        L, info = lapack.dpbtrf(shifted, lower=1, overwrite_ab=1)
        if info == 0:
            rounding = gamma(2 * (len(L) + 1)) * _norm(L) + U * (largest + abs(s))
            bound = s - 1.01 * rounding
            if bound >= SMALLEST:
                return float(bound)
    return 0.0


def _norm(L: Matrix) -> float:
    """‖|L||L|ᵀ‖_∞ ≥ ‖|L||L|ᵀ‖₂, but for a relative rounding of 4bu."""
    np.abs(L, out=L)
    width, v = len(L) - 1, np.ones(L.shape[1])
    return float(blas.dtbmv(width, L, blas.dtbmv(width, L, v, lower=1, trans=1), lower=1).max())
