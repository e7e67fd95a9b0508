"""All of Q = AᵀK⁻¹A for few contacts, from the band factor of a large K = LLᵀ.

With Y = L⁻¹A it is YᵀY. In blocks of unknowns as wide as the band, each block of Y needs only the one before,

    L_ii Y_i = A_i − L_{i,i−1} Y_{i−1},        Q = Σ_i Y_iᵀ Y_i,

in matrix–matrix operations, where K⁻¹A by `solve` would read the band once for each contact.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.linalg import blas

from .assembly import Matrix
from .near_inverse import band_blocks
from .sparse_factor import BandFactor, Factor, Renumbered

AT_A_TIME = 64  # columns of K⁻¹A by a general factor


def whole_compliance(factor: Factor, A: sp.csc_array) -> Matrix:
    """Q (m, m), mm/N, of one block of K. A : (N, m), its rows of A."""
    if isinstance(factor, Renumbered):
        return whole_compliance(factor.band, sp.csc_array(A[factor.order]))
    return _of_band(factor, A) if isinstance(factor, BandFactor) else _of_any(factor, A)


def _of_band(factor: BandFactor, A: sp.csc_array) -> Matrix:
    size, width = factor.L.shape[1], max(len(factor.L) - 1, 1)
    m = A.shape[1]
    # A contact is zero in Y before its first unknown: with these ascending, the first columns are enough.
    first, some = np.full(m, size), np.diff(A.indptr) > 0
    if some.any():
        first[some] = np.minimum.reduceat(A.indices, A.indptr[:-1][some])
    order = np.argsort(first, kind="stable")
    begun = np.searchsorted(first[order], np.arange(width, size + width, width))
    rows = sp.csr_array(A[:, order])
    found, Y, below = (np.zeros(shape, order="F") for shape in ((m, m), (0, 0), (0, 0)))
    for start, count in zip(range(0, size, width), begun, strict=True):
        if count == 0:
            continue
        stop = min(start + width, size)
        right = rows[start:stop, :count].toarray(order="F")
        if Y.size:
            right[:, : Y.shape[1]] -= below @ Y
        diagonal, below = band_blocks(factor.L, start, stop, width, np.dtype(float))
        Y = blas.dtrsm(1.0, diagonal, right, lower=1, overwrite_b=1)
        found[:count, :count] += Y.T @ Y
    Q = np.empty_like(found)
    Q[np.ix_(order, order)] = found
    return Q


def _of_any(factor: Factor, A: sp.csc_array) -> Matrix:
    Q = np.empty(A.shape[1:] * 2)
    for start in range(0, A.shape[1], AT_A_TIME):
        some = slice(start, start + AT_A_TIME)
        Q[:, some] = A.T @ factor.solve(A[:, some].toarray())
    return (Q + Q.T) / 2
