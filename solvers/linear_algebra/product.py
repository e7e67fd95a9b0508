"""Products with a symmetric matrix."""

from __future__ import annotations

import numpy as np
from scipy.linalg import blas

from problems.forms.assembly import Matrix, Vector
from problems.forms.compliance import AnyQ, Compliance

#: Above this fraction of nonzero entries, a product with the whole matrix beats one with copied columns.
SPARSE_LIMIT = 1 / 8


def product(G: AnyQ, v: Vector) -> Vector:
    """G v for G symmetric, column-major: reads one triangle, or only the columns where v is nonzero.

    G may be given by its products. Only SciPy's BLAS is called: NumPy's has its own thread pool, and each
    pool spins while the other works.
    """
    if isinstance(G, Compliance):
        return G @ v
    support = np.flatnonzero(v)
    if support.size > SPARSE_LIMIT * len(v):
        return blas.dsymv(1.0, G, v)
    return blas.dgemv(1.0, G.T[support].T, v[support]) if support.size else np.zeros(len(v))


def products(G: AnyQ, V: Matrix) -> Matrix:
    """G V for columns V (m, k), column-major."""
    if isinstance(G, Compliance):
        return G @ V
    return product(G, V[:, 0])[:, None] if V.shape[1] == 1 else blas.dgemm(1.0, G, V)
