"""Products with a symmetric matrix."""

import numpy as np
from scipy.linalg import blas

from .assembly import Matrix

#: Above this fraction of nonzero entries, a product with the whole matrix beats one with copied columns.
SPARSE_LIMIT = 1 / 8


def product(G: Matrix, v: Matrix) -> Matrix:
    """G v for G symmetric, column-major, v (m,) or columns (m, k). One reads a triangle, or only the
    columns where v is nonzero.

    Only SciPy's BLAS is called: NumPy's has its own thread pool, and each pool spins while the other works.
    """
    if v.ndim == 2:
        return product(G, v[:, 0])[:, None] if v.shape[1] == 1 else blas.dgemm(1.0, G, v)
    support = np.flatnonzero(v)
    if support.size > SPARSE_LIMIT * len(v):
        return blas.dsymv(1.0, G, v)
    return blas.dgemv(1.0, G.T[support].T, v[support]) if support.size else np.zeros(len(v))
