"""The full inverse of a symmetric positive definite matrix."""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from scipy.linalg import lapack

from problems.forms.assembly import Matrix

BLOCK = 256  # rows mirrored at once: a block and its mirror stay in the cache


def inverse_with_factor(Q: Matrix) -> tuple[Matrix, Matrix]:
    """(Q⁻¹, U) with Q = UᵀU, both (m, m). Raises LinAlgError if Q is not positive definite."""
    U = sla.cholesky(Q, check_finite=False)
    inverse, info = lapack.dpotri(U)
    if info != 0:
        raise np.linalg.LinAlgError(f"dpotri returned {info}")
    mirror(inverse)
    return inverse, U


def mirror(upper: Matrix) -> None:
    """Copy the upper triangle onto the lower, in place."""
    m = len(upper)
    for i in range(0, m, BLOCK):
        rows = slice(i, i + BLOCK)
        upper[i + BLOCK :, rows] = upper[rows, i + BLOCK :].T
        block = upper[rows, rows]
        upper[rows, rows] = np.triu(block) + np.triu(block, 1).T
