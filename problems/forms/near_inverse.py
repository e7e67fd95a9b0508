"""The entries of K⁻¹ near the diagonal, from the band factor K = LLᵀ, without the others.

With the unknowns in blocks as wide as the band, L has blocks on the diagonal and beside it, and with
U_i = L_{i+1,i} L_ii⁻¹ the blocks of Z = K⁻¹ follow from the last to the first (Takahashi, Fagan and Chen,
8th PICA Conf., 1973, block by block):

    Z_ii = (L_ii L_iiᵀ)⁻¹ + U_iᵀ Z_{i+1,i+1} U_i,        Z_ij = −U_iᵀ Z_{i+1,j},   j > i.

Beyond the diagonal only the columns asked for are formed. About 5 b³ operations per block, matrix–matrix, in
single precision where that suffices: what is built from them is a preconditioner.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

from .sparse_factor import BandFactor

Rows = NDArray[np.intp]
Entries = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class NearInverse:
    """K⁻¹ at rows that are at most some distance apart.

    rows : the unknowns asked for, ascending. starts : (blocks + 1,) where each block's begin among them.
    panels : for each block, its rows of K⁻¹ at its own and the following blocks' unknowns.
    """

    rows: Rows
    starts: Rows
    panels: tuple[Entries, ...]

    def submatrix(self, start: int, stop: int) -> Entries:
        """K⁻¹ at rows[start:stop], which must be within the reach."""
        Z = np.empty((stop - start, stop - start), dtype=self.panels[0].dtype)
        first = int(np.searchsorted(self.starts, start, side="right")) - 1
        for block in range(first, len(self.panels)):
            begin, end = max(self.starts[block], start), min(self.starts[block + 1], stop)
            if begin >= stop:
                break
            offset = self.starts[block]
            part = self.panels[block][begin - offset : end - offset, begin - offset : stop - offset]
            Z[begin - start : end - start, begin - start :] = part
            Z[begin - start :, begin - start : end - start] = part.T
        return Z


def near_inverse(factor: BandFactor, rows: Rows, reach: int, single: bool = True) -> NearInverse:
    """K⁻¹ at pairs of `rows`, ascending, that are at most `reach` unknowns apart. single : the precision."""
    L, dtype = factor.L, np.dtype(np.float32 if single else np.float64)
    potri = lapack.spotri if single else lapack.dpotri
    trsm, symm, gemm = (getattr(blas, ("s" if single else "d") + name) for name in ("trsm", "symm", "gemm"))
    size = L.shape[1]
    width = max(L.shape[0] - 1, 1)
    edges = np.arange(0, size + width, width).clip(max=size)
    count, further = len(edges) - 1, -(-reach // width)
    starts = np.searchsorted(rows, edges)
    own = [rows[starts[i] : starts[i + 1]] - edges[i] for i in range(count)]
    panels: list[Entries] = [np.zeros((0, 0), dtype)] * count
    Z = np.zeros((0, 0), dtype, order="F")
    columns: list[Entries] = []  # of the following blocks: Z_{i+1,j} at the columns asked for
    for i in reversed(range(count)):
        diagonal, below = band_blocks(L, int(edges[i]), int(edges[i + 1]), width, dtype)
        inverse = potri(diagonal, lower=1)[0]
        Z_ii = np.tril(inverse) + np.tril(inverse, -1).T
        if i + 1 < count:
            U = trsm(1.0, diagonal, below, side=1, lower=1)
            ZU = symm(1.0, Z, U)
            Z_ii = gemm(1.0, U, ZU, beta=1.0, c=np.asfortranarray(Z_ii), trans_a=1, overwrite_c=1)
            columns = [gemm(-1.0, U, each, trans_a=1) for each in columns[:further]]
        Z = np.asfortranarray(Z_ii)
        columns = [np.asfortranarray(Z[:, own[i]]), *columns]
        panels[i] = np.hstack([each[own[i]] for each in columns])
    return NearInverse(rows, starts, tuple(panels))


def band_blocks(
    L: NDArray[np.float64], start: int, stop: int, width: int, dtype: np.dtype[Any]
) -> tuple[Entries, Entries]:
    """L_ii, lower triangular, and L_{i+1,i} (upper triangular, as many rows as there are)."""
    size = L.shape[1]
    after = min(stop + width, size) - stop
    tall = stop - start + after
    # Entry (r, c) of these columns is L[r − c, start + c]: a view with a slanted stride.
    row, column = L.strides
    slanted = np.lib.stride_tricks.as_strided(
        L[:, start:], shape=(tall, stop - start), strides=(row, column - row), writeable=False
    )
    whole = np.array(slanted, dtype, order="F")
    diagonal = np.asfortranarray(np.tril(whole[: stop - start]))
    # Its entries are those at most len(L) − 1 from the diagonal: none, where K is diagonal and `width` is 1.
    below = np.asfortranarray(np.triu(whole[stop - start :], k=stop - start - (len(L) - 1)))
    return diagonal, below
