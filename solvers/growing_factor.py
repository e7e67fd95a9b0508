"""The Cholesky factor of a matrix that grows and shrinks by one row and column at a time."""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from scipy.linalg import blas

from problems.assembly import Matrix, Vector

BLOCK = 128


class GrowingFactor:
    """R upper triangular with RᵀR = G_CC for the ordered set C.

    Solves and deletions work on blocks of rows, so that all but the small diagonal blocks is
    matrix–vector and matrix–matrix work in place.
    """

    def __init__(self, capacity: int) -> None:
        self._R = np.zeros((capacity, capacity), order="F")
        self.size = 0

    @property
    def R(self) -> Matrix:
        """(size, size) view."""
        return self._R[: self.size, : self.size]

    def append(self, d: Vector, sigma: float) -> None:
        """C ← C ∪ {k}, with d = R⁻ᵀ G_Ck and σ² = G_kk − dᵀd."""
        q = self.size
        self._R[:q, q] = d
        self._R[q, q] = sigma
        self.size += 1

    def delete(self, j: int) -> None:
        """C ← C without its j-th member: the row that is left over is rotated into those below it."""
        q = self.size
        R = self._R
        v = R[j, j + 1 : q].copy()
        R[:j, j : q - 1] = R[:j, j + 1 : q]
        R[j : q - 1, j : q - 1] = R[j + 1 : q, j + 1 : q]
        self.size = q = q - 1
        for a in range(j, q, BLOCK):
            b = min(a + BLOCK, q)
            # [R_bb; v_b] = W [R_bb'; 0], and Wᵀ acts on the rest of these rows and of v.
            W, corner = sla.qr(np.vstack([R[a:b, a:b], v[a - j : b - j]]), check_finite=False)
            rest = W.T @ np.vstack([R[a:b, b:q], v[b - j :]])
            R[a:b, a:b], R[a:b, b:q], v[b - j :] = corner[:-1], rest[:-1], rest[-1]

    def solve_transposed(self, b: Vector) -> Vector:
        """R⁻ᵀ b."""
        R, z = self._R, b.copy()
        for a in range(0, self.size, BLOCK):
            e = min(a + BLOCK, self.size)
            z[a:e] -= R[:a, a:e].T @ z[:a]
            z[a:e] = blas.dtrsv(np.asfortranarray(R[a:e, a:e]), z[a:e], trans=1)
        return z

    def solve(self, b: Vector) -> Vector:
        """R⁻¹ b."""
        R, z = self._R, b.copy()
        for a in reversed(range(0, self.size, BLOCK)):
            e = min(a + BLOCK, self.size)
            z[a:e] = blas.dtrsv(np.asfortranarray(R[a:e, a:e]), z[a:e])
            z[:a] -= R[:a, a:e] @ z[a:e]
        return z
