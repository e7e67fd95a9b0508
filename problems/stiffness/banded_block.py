"""A sparse block with a narrow band, in some numbering: K = LLᵀ in (b + 1) N numbers, LAPACK's dpbtrf."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import blas

from . import Indices, Matrix, U, Vector, gamma
from .band_factor import band_blocks, band_cholesky, band_solve, lower_band
from .block import NotPositiveDefinite, SparseBlock, scaled
from .selected_inverse import BlockPart

WIDTH = 64  # unknowns of a block of `compliance`, or more


class BandedBlock(SparseBlock):
    """order : the unknowns in the order of the band; None as they are. width : the half-bandwidth b then."""

    def __init__(self, matrix: sp.csc_array, width: int, order: Indices | None = None) -> None:
        super().__init__(matrix)
        self.width, self.order = width, order

    def replaced(self, matrix: sp.csc_array) -> Self:
        return type(self)(matrix, self.width, self.order)

    @cached_property
    def L(self) -> Matrix:
        """(b + 1, N), column-major: L[j + d, j] in row d. Raises NotPositiveDefinite."""
        band = lower_band(self._ordered(self.matrix))
        smallest = self.lost * band[0]
        L, info = band_cholesky(band)
        lost = [info - 1] if info else np.flatnonzero(L[0] ** 2 <= smallest)
        if len(lost):
            raise NotPositiveDefinite(int(lost[0] if self.order is None else self.order[lost[0]]))
        return L

    def _ordered(self, M: sp.csc_array) -> sp.csc_array:
        return M if self.order is None else sp.csc_array(M[self.order][:, self.order])

    def factor(self) -> list[NDArray[Any]]:
        return [self.L]

    @property
    def band(self) -> tuple[int, Indices | None]:
        return self.width, self.order

    @property
    def factor_nonzeros(self) -> int:
        return self.size * (self.width + 1)

    def solve(self, b: Matrix) -> Matrix:
        if self.order is None:
            return band_solve(self.L, b)
        x = np.empty_like(b)
        x[self.order] = band_solve(self.L, b[self.order])
        return x

    def shifted(self, D: Vector, s: float) -> float | None:
        """As for a dense block, but no sum has more than b + 1 terms (Higham 2002, theorem 10.3)."""
        band = lower_band(self._ordered(scaled(self.matrix, D, D)))
        band[0] -= s
        largest = float(abs(band[0]).max())
        L, info = band_cholesky(band)
        return None if info else gamma(2 * (len(L) + 1)) * _norm(L) + U * (largest + abs(s))

    def compliance(self, A: sp.csc_array) -> Matrix:
        """With Y = L⁻¹A it is YᵀY. In blocks of unknowns at least as wide as the band, each block of Y needs
        only the one before,

            L_ii Y_i = A_i − L_{i,i−1} Y_{i−1},        Q = Σ_i Y_iᵀ Y_i,

        in matrix–matrix operations, where K⁻¹A by `solve` would read the band once for each contact. A column
        that is zero in Y_i, as those of the bodies before it are, takes no part where it is among the first.
        """
        A = self._rows(A)
        size, width, m = self.size, max(len(self.L) - 1, WIDTH), A.shape[1]
        # A contact is zero in Y before its first unknown: with these ascending, the first columns are enough.
        first, some = np.full(m, size), np.diff(A.indptr) > 0
        if some.any():
            first[some] = np.minimum.reduceat(A.indices, A.indptr[:-1][some])
        order = np.argsort(first, kind="stable")
        begun = np.searchsorted(first[order], np.arange(width, size + width, width))
        rows = sp.csr_array(A[:, order])
        found, Y, below = (np.zeros(shape, order="F") for shape in ((m, m), (0, 0), (0, 0)))
        live = 0  # the first column of Y_{i−1}
        for start, count in zip(range(0, size, width), begun, strict=True):
            stop = min(start + width, size)
            right = rows[start:stop, :count].toarray(order="F")
            if Y.size:
                right[: len(below), live : live + Y.shape[1]] -= below @ Y
            live = int(np.argmax(np.append(right.any(axis=0), True)))
            if live == count:
                Y = right[:, live:]
                continue
            diagonal, below = band_blocks(self.L, start, stop, width)
            Y = blas.dtrsm(1.0, diagonal, right[:, live:], lower=1, overwrite_b=1)
            found[live:count, live:count] += Y.T @ Y
        Q = np.empty_like(found)
        Q[np.ix_(order, order)] = found
        return Q

    def local_compliance(self, A: sp.csc_array, windows: Sequence[Indices], single: bool) -> BlockPart | None:
        return BlockPart.of(self.L, self._rows(A), windows, single)

    def _rows(self, A: sp.csc_array) -> sp.csc_array:
        return A if self.order is None else sp.csc_array(A[self.order])


def _norm(L: Matrix) -> float:
    """‖|L||L|ᵀ‖_∞ ≥ ‖|L||L|ᵀ‖₂, but for a relative rounding of 4bu."""
    np.abs(L, out=L)
    width, v = len(L) - 1, np.ones(L.shape[1])
    return float(blas.dtbmv(width, L, blas.dtbmv(width, L, v, lower=1, trans=1), lower=1).max())
