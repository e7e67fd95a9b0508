"""The Cholesky factor of a matrix that grows and shrinks by one row and column at a time."""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from scipy.linalg import blas

from problems.forms.assembly import Matrix, Vector

BLOCK = 128  # rows of a block in the solves
NARROW = 32  # rows rotated at once in a deletion


class GrowingFactor:
    """R upper triangular with RᵀR = G_CC for the ordered set C.

    Solves and deletions work on blocks of rows, so that all but the small diagonal blocks is
    matrix–vector and matrix–matrix work in place. Copies of the diagonal blocks are kept, because
    the triangular solve wants them contiguous.
    """

    def __init__(self, capacity: int) -> None:
        self._R = np.zeros((capacity, capacity), order="F")
        self._diagonal: list[Matrix] = []
        self.size = 0

    @property
    def R(self) -> Matrix:
        """(size, size) view."""
        return self._R[: self.size, : self.size]

    def append(self, d: Vector, sigma: float) -> None:
        """C ← C ∪ {k}, with d = R⁻ᵀ G_Ck and σ² = G_kk − dᵀd."""
        self.extend(d[:, None], np.array([[sigma]]))

    def extend(self, D: Matrix, T: Matrix) -> None:
        """C ← C ∪ E, with D = R⁻ᵀ G_CE and T upper triangular, TᵀT = G_EE − DᵀD."""
        q, self.size = self.size, self.size + len(T)
        self._R[:q, q : self.size] = D
        self._R[q : self.size, q : self.size] = T
        self._renew_diagonal(q)

    def delete(self, j: int) -> None:
        """C ← C without its j-th member: the row that is left over is rotated into those below it."""
        R, q = self._R, self.size - 1
        v = R[j, j + 1 : q + 1].copy()
        for a in range(j, q, BLOCK):  # move the columns to the left, the rows below j up
            b = min(a + BLOCK, q)
            R[:j, a:b] = R[:j, a + 1 : b + 1]
            R[j:b, a:b] = R[j + 1 : b + 1, a + 1 : b + 1]
        for a in range(j, q, NARROW):
            b = min(a + NARROW, q)
            # [R_bb; v_b] = W [R_bb'; 0], and Wᵀ acts on the rest of these rows and of v.
            W, corner = sla.qr(np.vstack([R[a:b, a:b], v[a - j : b - j]]), check_finite=False)
            rest = W.T @ np.vstack([R[a:b, b:q], v[b - j :]])
            R[a:b, a:b], R[a:b, b:q], v[b - j :] = corner[:-1], rest[:-1], rest[-1]
        self.size = q
        self._renew_diagonal(j)

    def _renew_diagonal(self, j: int) -> None:
        """Copy the diagonal blocks from the one of row j on."""
        del self._diagonal[j // BLOCK :]
        for a in range(j // BLOCK * BLOCK, self.size, BLOCK):
            e = min(a + BLOCK, self.size)
            self._diagonal.append(np.asfortranarray(self._R[a:e, a:e]))

    def solve_transposed(self, b: Vector) -> Vector:
        """R⁻ᵀ b, for one right-hand side or several columns."""
        R, z = self._R, b.copy()
        for k, block in enumerate(self._diagonal):
            a, e = k * BLOCK, k * BLOCK + len(block)
            z[a:e] -= R[:a, a:e].T @ z[:a]
            z[a:e] = _solved(block, z[a:e], 1)
        return z

    def solve(self, b: Vector) -> Vector:
        """R⁻¹ b."""
        R, z = self._R, b.copy()
        for k, block in reversed(list(enumerate(self._diagonal))):
            a, e = k * BLOCK, k * BLOCK + len(block)
            z[a:e] = _solved(block, z[a:e], 0)
            z[:a] -= R[:a, a:e] @ z[a:e]
        return z


def _solved(block: Matrix, b: Vector, transposed: int) -> Vector:
    if b.ndim == 1:
        return blas.dtrsv(block, b, trans=transposed)
    return blas.dtrsm(1.0, block, b, trans_a=transposed)
