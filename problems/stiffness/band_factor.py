"""A symmetric band, K = LLᵀ, and X = (LLᵀ)⁻¹B for many right-hand sides at once.

With the unknowns in blocks as wide as the band, L has blocks on the diagonal and beside it, so that

    L_ii Y_i = B_i − L_{i,i−1} Y_{i−1},        L_iiᵀ X_i = Y_i − L_{i+1,i}ᵀ X_{i+1},

in matrix–matrix products instead of a pass over L for each right-hand side, as LAPACK's dpbtrs makes. A band
is in LAPACK's lower storage, (b + 1, N) by columns: entry (j + d, j) in row d. So entry (i, j) is b places
from entry (i, j + 1): with b as its leading dimension, each block is an ordinary matrix, not copied.
"""

from collections.abc import Iterator
from contextlib import nullcontext, suppress
from functools import cache, partial
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
WINDOW = 8  # half-bandwidths of columns that are factored at a time where no factor is kept

Entries = NDArray[np.floating[Any]]


def half_bandwidth(K: sp.csc_array) -> int:
    """max i − j over the entries of K, at least 0."""
    filled = np.flatnonzero(np.diff(K.indptr))
    lowest = np.maximum.reduceat(K.indices, K.indptr[filled]) if filled.size else filled
    return int((lowest - filled).max(initial=0))


def lower_band(K: sp.csc_array, width: int) -> Matrix:
    """(b + 1, N) column-major, K[j + d, j] in row d. K : without duplicates. width : b."""
    size = K.shape[0]
    band = np.empty((width + 1, size), order="F")  # in large pages, where zeros() would be given small ones
    for start in range(0, size, COLUMNS_AT_A_TIME):
        _fill(band[:, start : start + COLUMNS_AT_A_TIME], K, start)
    return band


def _fill(band: Matrix, K: sp.csc_array, start: int) -> None:
    """Write columns of K, from `start` on, into a band."""
    stop, entries = start + band.shape[1], band.ravel(order="K")
    entries[:] = 0.0
    stored = slice(K.indptr[start], K.indptr[stop])
    columns = np.repeat(np.arange(stop - start), np.diff(K.indptr[start : stop + 1]))
    below, values = K.indices[stored] - start - columns, K.data[stored]
    lower = below >= 0
    entries[columns[lower] * len(band) + below[lower]] = values[lower]


def factor_pieces(K: sp.csc_array, width: int, s: float = 0.0) -> Iterator[tuple[int, int, Matrix]]:
    """(start, count, columns of L from `start` on) of K − sI = LLᵀ, b columns more than count.

    They stay in the processor's cache, and are overwritten by the next. The further ones belong to a multiple
    of I in place of K's, so large that it stays definite where K − sI is. Raises LinAlgError where it is not.
    """
    size, most = K.shape[0], WINDOW * max(width, NARROW)
    window = np.empty((width + 1, most + width), order="F")
    taken = np.zeros((width, width))  # by the last columns from those that follow
    for start in range(0, size, most):
        count = min(most, size - start)
        band, near = window[:, : count + width], min(width, count)
        _fill(band[:, :count], K, start)
        band[0, :count] -= s
        band[:, count:] = 0.0
        band[0, count:] = 2 * (width + 1) * abs(band[0, :count]).max()
        _part(band, 0, 0, near, near)[...] -= np.tril(taken[:near, :near])
        L, info = band_cholesky(band)
        if info:
            raise np.linalg.LinAlgError(f"the leading minor {start + info} is not positive definite")
        if start + count < size:
            triangle = np.triu(_part(L, count, count - width, width, width))
            taken = triangle @ triangle.T
        yield start, count, L


def factor_norm(K: sp.csc_array, width: int, s: float) -> float | None:
    """‖|L||L|ᵀ‖_∞ ≥ ‖|L||L|ᵀ‖₂ of K − sI = LLᵀ, up to a relative rounding of 4bu; None where there is no L.

    L is not kept: fresh memory for it would take longer than its entries.
    """
    sums = np.zeros(K.shape[0] + width)
    with suppress(np.linalg.LinAlgError):
        for start, count, L in factor_pieces(K, width, s):
            np.abs(L, out=L)
            L[:, count:] = 0.0
            of_columns = blas.dtbmv(width, L, np.ones(count + width), lower=1, trans=1)
            sums[start : start + count + width] += blas.dtbmv(width, L, of_columns, lower=1)
        return float(sums.max())
    return None


def rounded_factor(K: sp.csc_array, width: int, dtype: type[np.floating[Any]]) -> Entries:
    """L (b + 1, N), column-major, of K = LLᵀ in a type of lower precision, made in double precision."""
    rounded = np.empty((width + 1, K.shape[0]), dtype, order="F")
    for start, count, L in factor_pieces(K, width):
        rounded[:, start : start + count] = L[:, :count]
    return rounded


def band_cholesky(band: Matrix) -> tuple[Matrix, int]:
    """L (b + 1, N) of a symmetric band, which it replaces, and dpbtrf's info.

    On one thread up to b = 700: a second one makes narrow bands up to 4 times slower, as the steps are small.
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
    X, edges = np.array(b, dtype=float, order="C"), [*range(0, size, width), size]
    part = partial(_part, L)
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


def _part(band: Matrix, row: int, column: int, rows: int, columns: int) -> Matrix:
    """A part of the matrix of a band from (row, column) on, not copied; entries outside are arbitrary."""
    entries, width = band.ravel(order="K"), len(band) - 1
    step = entries.itemsize
    return np.ndarray((rows, columns), float, entries, (column * width + row) * step, (step, width * step))


def band_blocks(
    L: Entries, start: int, stop: int, width: int, dtype: type[np.floating[Any]] = np.float64
) -> tuple[Entries, Entries]:
    """L_ii, lower triangular, and L_{i+1,i} (upper triangular, as many rows as there are)."""
    wide, after = stop - start, min(stop + width, L.shape[1]) - stop
    whole = np.zeros((wide + len(L), wide), dtype, order="F")
    row, column = whole.strides
    # Entry L[d, start + c] is entry (c + d, c) of these columns: a view with a slanted stride.
    slanted = np.lib.stride_tricks.as_strided(whole, shape=(len(L), wide), strides=(row, row + column))
    slanted[...] = L[:, start:stop]
    return np.asfortranarray(whole[:wide]), np.asfortranarray(whole[wide : wide + after])
