"""Q = AᵀK⁻¹A, (m, m) mm/N, as a matrix, or by solutions with K: products and principal submatrices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import blas

from problems.stiffness.operator import Stiffness

from .assembly import Indices, Matrix

#: Above this fraction of nonzero entries, a product with the whole matrix beats one with copied columns.
SPARSE_LIMIT = 1 / 8
#: A window of contacts → its principal submatrix of Q, stored by columns, which may be overwritten.
Local = Callable[[Indices], Matrix]


def product(G: Matrix, v: Matrix) -> Matrix:
    """G v for G symmetric, column-major, v (m,) or columns (m, k). One reads a triangle, or only the
    columns where v is nonzero.

    Only SciPy's BLAS is called: NumPy's has its own thread pool, and each pool spins while the other works.
    """
    if v.ndim == 2 and v.shape[1] != 1:
        return blas.dgemm(1.0, G, v)
    one = v.ravel()
    support = np.flatnonzero(one)
    if support.size > SPARSE_LIMIT * len(one):
        found = blas.dsymv(1.0, G, one)
    else:
        found = blas.dgemv(1.0, G.T[support].T, one[support]) if support.size else np.zeros(len(one))
    return found.reshape(v.shape)


@dataclass(frozen=True)
class ComplianceProducts:
    """By solutions with K."""

    K: Stiffness
    A: sp.csc_array

    def __matmul__(self, lam: Matrix) -> Matrix:
        """Q λ, λ (m,) or (m, k)."""
        product: Matrix = self.A.T @ self.K.solve(self.A @ lam)
        return product

    def submatrix(self, rows: Indices) -> ComplianceProducts:
        """The principal submatrix of some contacts."""
        return ComplianceProducts(self.K, self.A[:, rows])

    def toarray(self) -> Matrix:
        """The matrix, by columns."""
        return self.K.compliance(self.A)

    def local(self, windows: Sequence[Indices], single: bool) -> Local | None:
        """Principal submatrices of windows of contacts near each other, in single precision to about four
        digits; None where they cost too much.
        """
        return self.K.local_compliance(self.A, windows, single)


@dataclass(frozen=True)
class DenseCompliance:
    """Q : by columns, perhaps memory-mapped."""

    Q: Matrix

    def __matmul__(self, lam: Matrix) -> Matrix:
        return product(self.Q, lam)

    def submatrix(self, rows: Indices) -> DenseCompliance:
        return DenseCompliance(self.Q[np.ix_(rows, rows)].T)

    def toarray(self) -> Matrix:
        return self.Q

    def local(self, windows: Sequence[Indices], single: bool) -> Local:
        rows = np.asarray(self.Q).T  # no memory map, whose views cost more than their copies
        return lambda window: rows[np.ix_(window, window)].T


Compliance = ComplianceProducts | DenseCompliance
