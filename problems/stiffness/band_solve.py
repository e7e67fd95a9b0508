"""K = LLᵀ of a band, and X = (LLᵀ)⁻¹B for many right-hand sides at once: matrix–matrix products instead of a
pass over L for each of them, as LAPACK's dpbtrs makes.

In LAPACK's storage, (b + 1, N) by columns, entry (i, j) of L is b places from entry (i, j + 1): with b as its
leading dimension, any part of L inside the band is an ordinary matrix, not copied. A panel of rows has a
triangle at the edge of the band, a rectangle, and a triangle at the diagonal.
"""

from functools import cache
from itertools import pairwise

import numpy as np
import threadpoolctl
from scipy.linalg import blas, lapack

from .arrays import Matrix

PANEL = 64  # rows; a narrower band is solved by dpbtrs
FEW = 2  # right-hand sides, for which dpbtrs is as fast


def band_cholesky(band: Matrix) -> tuple[Matrix, int]:
    """L (b + 1, N) of a symmetric band in LAPACK's lower storage, which it replaces, and dpbtrf's info.

    On one thread: a second one makes it 1.2 to 4 times slower at b = 80 to 420, as its steps are small.
    """
    with _threads().limit(limits=1):
        L, info = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
    return L, int(info)


@cache
def _threads() -> threadpoolctl.ThreadpoolController:
    """The libraries are searched for once: it takes longer than a factorisation."""
    return threadpoolctl.ThreadpoolController()


def band_solve(L: Matrix, b: Matrix) -> Matrix:
    """(LLᵀ)⁻¹ b, b (N,) or (N, k). L : (b + 1, N) column-major, L[j + d, j] in row d."""
    if b.ndim == 1 or b.shape[1] <= FEW or len(L) <= PANEL:
        x: Matrix = lapack.dpbtrs(L, b, lower=1)[0]
        return x
    X = np.array(b, dtype=float, order="C")
    _Panels(L).solve(X)
    return X


class _Panels:
    """Panels of L. None begins in the first b rows and ends beyond them: its edge would be no triangle."""

    def __init__(self, L: Matrix) -> None:
        self.entries, self.width, self.size = L.ravel(order="K"), len(L) - 1, L.shape[1]
        whole = min(self.width + 1, self.size)
        edges = [*range(0, whole, PANEL), *range(whole, self.size, PANEL), self.size]
        self.panels = list(pairwise(edges))

    def solve(self, X: Matrix) -> None:
        """X (N, k) by rows, in place."""
        for start, stop in self.panels:
            self._forward(X, start, stop)
        for start, stop in reversed(self.panels):
            self._backward(X, start, stop)

    def _part(self, rows: slice, columns: slice) -> Matrix:
        """L[rows, columns]; what is not in the band is arbitrary."""
        b = self.width
        shape = rows.stop - rows.start, columns.stop - columns.start
        offset, step = columns.start * b + rows.start, self.entries.itemsize
        return np.ndarray(shape, float, self.entries, offset * step, (step, b * step))

    def _forward(self, X: Matrix, start: int, stop: int) -> None:
        own, rows = X[start:stop], slice(start, stop)
        edge, full = max(start - self.width, 0), max(stop - 1 - self.width, 0)
        if full < start:
            own -= self._part(rows, slice(full, start)) @ X[full:start]
        if edge < full:
            tip = self._part(slice(start, start + full - edge), slice(edge, full))
            own[: full - edge] -= blas.dtrmm(1.0, tip, X[edge:full].T, side=1, trans_a=1).T
        blas.dtrsm(1.0, self._part(rows, rows), own.T, side=1, lower=1, trans_a=1, overwrite_b=1)

    def _backward(self, X: Matrix, start: int, stop: int) -> None:
        own, columns = X[start:stop], slice(start, stop)
        full, edge = min(start + 1 + self.width, self.size), min(stop + self.width, self.size)
        if stop < full:
            own -= self._part(slice(stop, full), columns).T @ X[stop:full]
        if full < edge:
            rows, after = slice(full, edge), start + 1 + edge - full
            tip = self._part(rows, slice(start + 1, after))
            own[1 : after - start] -= blas.dtrmm(1.0, tip, X[rows].T, side=1).T
            if after < stop:  # below these columns K ends before the band does
                own[after - start :] -= self._part(rows, slice(after, stop)).T @ X[rows]
        blas.dtrsm(1.0, self._part(columns, columns), own.T, side=1, lower=1, overwrite_b=1)
