"""A symmetric band, K = LLᵀ, and X = (LLᵀ)⁻¹B for many right-hand sides at once.

With the unknowns in blocks as wide as the band, L has blocks on the diagonal and beside it, so that

    L_ii Y_i = B_i − L_{i,i−1} Y_{i−1},        L_iiᵀ X_i = Y_i − L_{i+1,i}ᵀ X_{i+1},

in matrix–matrix products instead of a pass over L for each right-hand side, as LAPACK's dpbtrs makes. A band
is in LAPACK's lower storage, (b + 1, N) by columns: entry (j + d, j) in row d. So entry (i, j) is b places
from entry (i, j + 1): with b as its leading dimension, each block is an ordinary matrix, not copied.
"""

from contextlib import nullcontext
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.sparse as sp
import threadpoolctl
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

from . import Matrix

NARROW = 64  # of a band: it is solved by dpbtrs
WIDE = 700  # of a band: its factor gains from a second thread
FEW = 2  # right-hand sides, for which dpbtrs is as fast
COLUMNS_AT_A_TIME = 1024  # that and their entries stay in the processor's cache

Entries = NDArray[np.floating[Any]]


def half_bandwidth(K: sp.csc_array) -> int:
    """max |i − j| over the entries of K."""
    columns = np.repeat(np.arange(K.shape[1], dtype=K.indices.dtype), np.diff(K.indptr))
    return int((K.indices - columns).max(initial=0))


def lower_band(K: sp.csc_array) -> Matrix:
    """(b + 1, N) column-major, K[j + d, j] in row d, b the half-bandwidth. K : without duplicates."""
    size, width = K.shape[0], half_bandwidth(K)
    band = np.empty((width + 1, size), order="F")  # in large pages, where zeros() would be given small ones
    entries = band.ravel(order="K")
    for start in range(0, size, COLUMNS_AT_A_TIME):
        stop = min(start + COLUMNS_AT_A_TIME, size)
        band[:, start:stop] = 0.0
        stored = slice(K.indptr[start], K.indptr[stop])
        columns = np.repeat(np.arange(start, stop), np.diff(K.indptr[start : stop + 1]))
        rows, values = K.indices[stored], K.data[stored]
        lower = rows >= columns
        # row − column + column (width + 1)
        entries[columns[lower] * width + rows[lower]] = values[lower]
    return band


def band_cholesky(band: Matrix) -> tuple[Matrix, int]:
    """L (b + 1, N) of a symmetric band, which it replaces, and dpbtrf's info.

    On one thread up to b = 700: a second one makes it 1.2 to 4 times slower at b = 80 to 420, as its steps
    are small, and takes 0.88, 0.64 and 0.57 of the time at 780, 1200 and 2273.
    """
    with nullcontext() if len(band) > WIDE else _threads().limit(limits=1):
        L, info = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
    return L, int(info)


@cache
def _threads() -> threadpoolctl.ThreadpoolController:
    """The libraries are searched for once: it takes longer than a factorisation."""
    return threadpoolctl.ThreadpoolController()


def band_solve(L: Matrix, b: Matrix) -> Matrix:
    """(LLᵀ)⁻¹ b, b (N,) or (N, k)."""
    width, size = len(L) - 1, L.shape[1]
    if b.ndim == 1 or b.shape[1] <= FEW or width < NARROW:
        x: Matrix = lapack.dpbtrs(L, b, lower=1)[0]
        return x
    X, edges, entries = (
        np.array(b, dtype=float, order="C"),
        [*range(0, size, width), size],
        L.ravel(order="K"),
    )

    def part(row: int, column: int, rows: int, columns: int) -> Matrix:
        """A part of L from (row, column) on, not copied; entries outside the band are arbitrary."""
        step = entries.itemsize
        return np.ndarray(
            (rows, columns), float, entries, (column * width + row) * step, (step, width * step)
        )

    for start, stop in pairwise(edges):
        block, after, count = X[start:stop], X[stop : stop + width], min(width, size - stop)
        diagonal = part(start, start, stop - start, stop - start)
        blas.dtrsm(1.0, diagonal, block.T, side=1, lower=1, trans_a=1, overwrite_b=1)
        if count:  # L_{i+1,i} is a triangle, and a rectangle beside it where K ends before the band does
            triangle = part(stop, start, count, count)
            after -= blas.dtrmm(1.0, triangle, block[:count].T, side=1, trans_a=1).T
            after -= part(stop, start + count, count, width - count) @ block[count:]
    for start, stop in reversed([*pairwise(edges)]):
        block, after, count = X[start:stop], X[stop : stop + width], min(width, size - stop)
        if count:
            block[:count] -= blas.dtrmm(1.0, part(stop, start, count, count), after.T, side=1).T
            block[count:] -= part(stop, start + count, count, width - count).T @ after
        diagonal = part(start, start, stop - start, stop - start)
        blas.dtrsm(1.0, diagonal, block.T, side=1, lower=1, overwrite_b=1)
    return X


def band_blocks(
    L: Matrix, start: int, stop: int, width: int, dtype: type[np.floating[Any]] = np.float64
) -> tuple[Entries, Entries]:
    """L_ii, lower triangular, and L_{i+1,i} (upper triangular, as many rows as there are)."""
    wide, after = stop - start, min(stop + width, L.shape[1]) - stop
    whole = np.zeros((wide + len(L), wide), dtype, order="F")
    row, column = whole.strides
    # Entry L[d, start + c] is entry (c + d, c) of these columns: a view with a slanted stride.
    slanted = np.lib.stride_tricks.as_strided(whole, shape=(len(L), wide), strides=(row, row + column))
    slanted[...] = L[:, start:stop]
    return np.asfortranarray(whole[:wide]), np.asfortranarray(whole[wide : wide + after])
