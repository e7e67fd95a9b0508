"""A sparse block with a narrow band, in some numbering: K = LLᵀ in (b + 1) N numbers, LAPACK's dpbtrf."""

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from . import Indices, Matrix, U, Vector, gamma
from .band_factor import band_cholesky, band_solve, factor_norm, lower_band, rounded_factor
from .block import NotPositiveDefinite, SparseBlock, scaled
from .selected_inverse import BlockPart


class BandedBlock(SparseBlock):
    """A block whose entries lie near the diagonal in some numbering.

    order : the unknowns in the order of the band; None, as they are. width : its half-bandwidth b.
    """

    def __init__(self, matrix: sp.csc_array, width: int, order: Indices | None = None) -> None:
        super().__init__(matrix)
        self.width, self.order = width, order

    @cached_property
    def L(self) -> Matrix:
        """(b + 1, N), column-major: L[j + d, j] in row d. Raises NotPositiveDefinite."""
        return self._factored(lower_band(self._ordered(self.matrix), self.width))

    def _factored(self, band: Matrix) -> Matrix:
        smallest = self.lost * band[0]
        L, info = band_cholesky(band)
        lost = [info - 1] if info else np.flatnonzero(L[0] ** 2 <= smallest)
        if len(lost):
            raise NotPositiveDefinite(int(lost[0] if self.order is None else self.order[lost[0]]))
        return L

    @cached_property
    def _places(self) -> tuple[Indices, Indices]:
        """The entries of the matrix that a band holds, and their places in it, column by column."""
        M = self.matrix
        rows, columns = M.indices, np.repeat(np.arange(self.size), np.diff(M.indptr))
        if self.order is not None:
            numbers = np.argsort(self.order)
            rows, columns = numbers[rows], numbers[columns]
        lower = np.flatnonzero(rows >= columns)
        return lower, columns[lower] * self.width + rows[lower]

    def solver(self, entries: Vector) -> Callable[[Matrix], Matrix]:
        lower, places = self._places
        band = np.empty((self.width + 1, self.size), order="F")
        flat = band.ravel(order="K")
        flat[:] = 0.0
        flat[places] = entries[lower]
        return partial(self._solved, self._factored(band))

    def _ordered(self, M: sp.csc_array) -> sp.csc_array:
        return M if self.order is None else sp.csc_array(M[self.order][:, self.order])

    def factor(self) -> list[NDArray[Any]]:
        return [self.L]

    @property
    def factor_nonzeros(self) -> int:
        return self.size * (self.width + 1)

    def solve(self, b: Matrix) -> Matrix:
        return self._solved(self.L, b)

    def _solved(self, L: Matrix, b: Matrix) -> Matrix:
        if self.order is None:
            return band_solve(L, b)
        x = np.empty_like(b)
        x[self.order] = band_solve(L, b[self.order])
        return x

    def shifted(self, D: Vector, s: float) -> float | None:
        """As for a dense block, but no sum has more than b + 1 terms (Higham 2002, theorem 10.3)."""
        M = self._ordered(scaled(self.matrix, D, D))
        norm, largest = factor_norm(M, self.width, s), float(abs(M.diagonal() - s).max())
        return None if norm is None else gamma(2 * (self.width + 2)) * norm + U * (largest + abs(s))

    def local_compliance(self, A: sp.csc_array, windows: Sequence[Indices], single: bool) -> BlockPart | None:
        rows = A if self.order is None else sp.csc_array(A[self.order])
        L = vars(self).get("L")
        if L is None:  # it is made for this alone, and not kept
            L = rounded_factor(self._ordered(self.matrix), self.width, np.float32 if single else np.float64)
        return BlockPart.of(L, rows, windows, single)
