"""Products with a symmetric matrix."""

from __future__ import annotations

import numpy as np
from scipy.linalg import blas

from problems.forms.assembly import Matrix, Vector

#: From this share of the columns on, a product with all of the matrix is faster than one with a copy.
COPY = 1 / 8


def product(G: Matrix, v: Vector) -> Vector:
    """G v for G symmetric, stored by columns: a triangle of it is read, or the columns where v is not zero.

    Only scipy's BLAS is called: NumPy has threads of its own, which would wait in turn, spinning.
    """
    support = np.flatnonzero(v)
    if support.size > COPY * len(v):
        return blas.dsymv(1.0, G, v)
    return blas.dgemv(1.0, G.T[support].T, v[support]) if support.size else np.zeros(len(v))
