"""Solves G_SS u_S = b_S for a sequence of sets S; many of them share one Cholesky factorisation.

For the base set B, G_BB = LLᵀ is factored. Another set S = (B \\ R) ∪ E adds a border: with
multipliers ν that enforce u_R = 0,

    [ G_BB  W ] [ u_B ]   [ b_B ]          W = [ G_BE  I_R ],    C = [ G_EE  0 ]
    [ Wᵀ    C ] [  v  ] = [  c  ],         v = (u_E, ν),             [  0    0 ],  c = (b_E, 0),

so that (C − ZᵀZ) v = c − Zᵀt with Z = L⁻¹W, t = L⁻¹b_B, and u_B = L⁻ᵀ(t − Zv). Each index is either
in B or not, so its column of Z is reused by every later set that needs it.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

from problems.forms.assembly import Matrix, Vector

from .block_pivoting import Set

#: A border wider than this fraction of the base costs about as much as a new factorisation.
MAX_BORDER = 1 / 8


class Principal:
    """G_SS u_S = b_S for a sequence of sets S, refactored when S differs too much from the base."""

    def __init__(self, G: Matrix) -> None:
        self.G = G
        self.factor = BorderedFactor(G, np.zeros(len(G), dtype=bool))
        self.factorisations = 0

    def move_to(self, S: Set) -> None:
        if self.factor.changes(S) <= MAX_BORDER * self.factor.rows.size:
            self.factor.move_to(S)
        else:
            self.factor = BorderedFactor(self.G, S)
            self.factorisations += 1


class BorderedFactor:
    """G : (m, m) symmetric, column-major. base : (m,) the factored set.

    Raises LinAlgError if G_BB is not positive definite.
    """

    def __init__(self, G: Matrix, base: Set) -> None:
        self.G = G
        self.base = base
        self.rows = np.flatnonzero(base)
        self.L = np.empty((0, 0), order="F")
        if self.rows.size:
            block = G.T[np.ix_(self.rows, self.rows)].T  # symmetric, and column-major like G
            self.L, info = lapack.dpotrf(block, lower=1, clean=False, overwrite_a=True)
            if info:
                raise np.linalg.LinAlgError(f"the leading minor {info} of G_BB is not positive definite")
        self.column = np.full(len(base), -1)  # of Z for each index; −1 if none yet
        self.Z = np.empty((self.rows.size, 0), order="F")
        self.move_to(base)

    def changes(self, S: Set) -> int:
        """The width of the border that S needs."""
        return int((S ^ self.base).sum())

    def move_to(self, S: Set) -> None:
        """Use S in the solves that follow."""
        self.S = S
        self.border = np.flatnonzero(S ^ self.base)
        if not self.border.size:
            return
        self._extend(self.border[self.column[self.border] < 0])
        Z = self.Z.T[self.column[self.border]].T
        corner = blas.dgemm(-1.0, Z, Z, trans_a=1) if self.rows.size else np.zeros((Z.shape[1],) * 2)
        entering = ~self.base[self.border]
        entered = self.border[entering]
        corner[np.ix_(entering, entering)] += self.G[np.ix_(entered, entered)]
        self.entering, self.Z_border = entering, Z
        self.corner = sla.lu_factor(corner, overwrite_a=True, check_finite=False)

    def solve(self, b: Vector) -> Vector:
        """u (m,) with G_SS u_S = b_S and zero elsewhere."""
        u = np.zeros(len(b))
        t = blas.dtrsv(self.L, b[self.rows], lower=1) if self.rows.size else b[self.rows]
        if self.border.size:
            c = np.where(self.entering, b[self.border], 0.0)
            Zt = blas.dgemv(1.0, self.Z_border, t, trans=1) if self.rows.size else 0.0
            v = sla.lu_solve(self.corner, c - Zt, check_finite=False)
            u[self.border[self.entering]] = v[self.entering]
        if self.rows.size:
            if self.border.size:
                t = blas.dgemv(-1.0, self.Z_border, v, 1.0, t)
            u[self.rows] = blas.dtrsv(self.L, t, lower=1, trans=1)
        u[~self.S] = 0.0  # which the multipliers enforce only up to rounding
        return u

    def _extend(self, new: NDArray[np.intp]) -> None:
        """Add columns of Z for indices that have none yet."""
        if not new.size:
            return
        W = np.zeros((self.rows.size, new.size), order="F")
        inside = self.base[new]
        W[np.searchsorted(self.rows, new[inside]), np.flatnonzero(inside)] = 1.0
        W[:, ~inside] = self.G[np.ix_(self.rows, new[~inside])]
        if self.rows.size:
            W = blas.dtrsm(1.0, self.L, W, lower=1, overwrite_b=True)
        self.column[new] = self.Z.shape[1] + np.arange(new.size)
        self.Z = np.hstack([self.Z, W])
