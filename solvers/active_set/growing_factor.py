"""A Cholesky factor, updated as rows and columns are added and deleted."""

import numpy as np
import scipy.linalg as sla
from scipy.linalg import blas

from problems.forms.assembly import Matrix, Vector

BLOCK = 128  # rows per block in the solves
ROTATION_BLOCK = 32  # rows rotated at once in a deletion


class GrowingFactor:
    """R upper triangular with RᵀR = G_CC for the ordered set C.

    Solves and deletions work on blocks of rows: outside the small diagonal blocks, all work is in-place
    matrix–vector and matrix–matrix products. Copies of the diagonal blocks are kept because the triangular
    solve needs them contiguous.
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
        self._copy_diagonal_blocks(q)

    def delete(self, j: int) -> None:
        """C ← C without its j-th member: the remainder of its row is rotated into the rows below."""
        R, q = self._R, self.size - 1
        v = R[j, j + 1 : q + 1].copy()
        for a in range(j, q, BLOCK):  # move the columns to the left, the rows below j up
            b = min(a + BLOCK, q)
            R[:j, a:b] = R[:j, a + 1 : b + 1]
            R[j:b, a:b] = R[j + 1 : b + 1, a + 1 : b + 1]
        for a in range(j, q, ROTATION_BLOCK):
            b = min(a + ROTATION_BLOCK, q)
            # [R_bb; v_b] = W [R_bb'; 0], and Wᵀ acts on the rest of these rows and of v.
            W, corner = sla.qr(np.vstack([R[a:b, a:b], v[a - j : b - j]]), check_finite=False)
            rest = W.T @ np.vstack([R[a:b, b:q], v[b - j :]])
            R[a:b, a:b], R[a:b, b:q], v[b - j :] = corner[:-1], rest[:-1], rest[-1]
        self.size = q
        self._copy_diagonal_blocks(j)

    def _copy_diagonal_blocks(self, j: int) -> None:
        """Copy the diagonal blocks, starting with that of row j."""
        del self._diagonal[j // BLOCK :]
        for a in range(j // BLOCK * BLOCK, self.size, BLOCK):
            e = min(a + BLOCK, self.size)
            self._diagonal.append(np.asfortranarray(self._R[a:e, a:e]))

    def solve_transposed(self, b: Vector) -> Vector:
        """R⁻ᵀ b, for one or several right-hand sides."""
        R, z = self._R, b.copy()
        for k, block in enumerate(self._diagonal):
            a, e = k * BLOCK, k * BLOCK + len(block)
            z[a:e] -= R[:a, a:e].T @ z[:a]
            z[a:e] = _triangular_solve(block, z[a:e], 1)
        return z

    def solve(self, b: Vector) -> Vector:
        """R⁻¹ b."""
        R, z = self._R, b.copy()
        for k, block in reversed(list(enumerate(self._diagonal))):
            a, e = k * BLOCK, k * BLOCK + len(block)
            z[a:e] = _triangular_solve(block, z[a:e], 0)
            z[:a] -= R[:a, a:e] @ z[a:e]
        return z


def _triangular_solve(block: Matrix, b: Vector, transposed: int) -> Vector:
    if b.ndim == 1:
        return blas.dtrsv(block, b, trans=transposed)
    return blas.dtrsm(1.0, block, b, trans_a=transposed)
