"""Q = AᵀK⁻¹A without the matrix: products and principal submatrices, by solutions with K."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .assembly import Matrix

Rows = NDArray[np.intp]


@dataclass(frozen=True)
class Compliance:
    """Q, or the principal submatrix of Q that belongs to the columns of A.

    solve_K : b (n,) or (n, k) → K⁻¹ b. A : (n, m) sparse.
    """

    solve_K: Callable[[Matrix], Matrix]
    A: sp.csc_array

    def __matmul__(self, lam: Matrix) -> Matrix:
        return self.A.T @ self.solve_K(self.A @ lam)

    def submatrix(self, rows: Rows) -> Compliance:
        return Compliance(self.solve_K, self.A[:, rows])

    def toarray(self) -> Matrix:
        Q = self @ np.eye(self.A.shape[1])
        return np.asfortranarray((Q + Q.T) / 2)


#: A dense Q, or its products.
AnyQ = Matrix | Compliance


def submatrix(Q: AnyQ, rows: Rows) -> AnyQ:
    """The principal submatrix for some contacts; a copy if Q is dense."""
    return Q.submatrix(rows) if isinstance(Q, Compliance) else np.ascontiguousarray(Q[np.ix_(rows, rows)])


def dense_submatrix(Q: AnyQ, rows: Rows) -> Matrix:
    """The same as a new array, stored by columns as LAPACK takes it."""
    return Q.submatrix(rows).toarray() if isinstance(Q, Compliance) else Q[np.ix_(rows, rows)].T
