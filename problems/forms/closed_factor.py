"""Q_CC⁻¹ of a dense Q for contact sets C that change: a Cholesky factor of one set, bordered by the changes.

With Q_BB = UᵀU, the contacts E that have entered since and D that have left are columns of a border,

    [ Q_BB   Q_BE  I_BD ] [ u_B ]   [ b_B ]
    [ Q_EB   Q_EE   0   ] [ u_E ] = [ b_E ]          W = [ Q_BE  I_BD ],    S = [ Q_EE  0 ] − WᵀQ_BB⁻¹W,
    [ I_DB    0     0   ] [  μ  ]   [  0  ]                                     [  0    0 ]

whose last row is u_D = 0. A border of k columns takes 2k|B|² operations where a new factor takes |C|³/3.
How many digits are left is for its user to tell, from y; a set whose S is singular is factored anew.
"""

import numpy as np
import scipy.linalg as sla

from .assembly import Indices, Mask, Matrix, Vector

WIDEST = 1 / 8  # of |B|: a wider border takes about as long as a new factor


class ClosedFactor:
    """Q (m, m), mm/N, by columns. No set is factored until `solve` is called."""

    def __init__(self, Q: Matrix) -> None:
        self.Q = Q
        self.B: Mask | None = None

    def solve(self, C: Mask, b: Vector) -> Vector:
        """u (m,) with Q_CC u_C = b_C and zero elsewhere. Raises LinAlgError if Q_CC is indefinite."""
        changed = np.flatnonzero(C if self.B is None else C ^ self.B)
        if self.B is None or not self._bordered(changed, self.B):
            self._factor(C)
            changed = changed[:0]
        u, v = np.zeros(len(b)), self._by_factor(b[self.rows])
        if changed.size:
            at, entered = np.searchsorted(self.changed, changed), C[changed]
            W, X = self.W[:, at], self.X[:, at]
            S = np.where(np.outer(entered, entered), self.Q[np.ix_(changed, changed)], 0.0) - W.T @ X
            *_, e, singular = sla.lapack.dgesv(S, np.where(entered, b[changed], 0.0) - W.T @ v)
            if singular:
                self.B = None
                return self.solve(C, b)
            v -= X @ e
            u[changed] = e
        u[self.rows] = v
        u[~C] = 0.0
        return u

    def _factor(self, C: Mask) -> None:
        self.B, self.rows = C, np.flatnonzero(C)
        Q_CC = self.Q[np.ix_(self.rows, self.rows)]
        try:
            self.U = sla.cholesky(Q_CC, overwrite_a=True, check_finite=False)
        except np.linalg.LinAlgError as error:
            raise np.linalg.LinAlgError(f"Q is not positive definite: {error}") from error
        self.changed = self.rows[:0]
        self.W = self.X = np.empty((len(self.rows), 0))

    def _by_factor(self, b: Matrix) -> Matrix:
        return sla.cho_solve((self.U, False), b, check_finite=False) if len(b) else b

    def _bordered(self, changed: Indices, B: Mask) -> bool:
        """Whether W and X = Q_BB⁻¹W have columns for these contacts, after adding those that are missing."""
        new = np.setdiff1d(changed, self.changed, assume_unique=True)
        if len(self.changed) + len(new) > WIDEST * len(self.rows):
            return not changed.size
        if new.size:
            W = np.where(B[new], self.rows[:, None] == new, self.Q[np.ix_(self.rows, new)])
            both = np.append(self.changed, new)
            order = np.argsort(both)
            self.changed = both[order]
            self.W = np.hstack([self.W, W])[:, order]
            self.X = np.hstack([self.X, self._by_factor(W)])[:, order]
        return True
