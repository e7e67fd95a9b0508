"""The full inverse of a symmetric positive definite matrix."""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from scipy.linalg import lapack

from problems.forms.assembly import Matrix


def inverse_with_factor(Q: Matrix) -> tuple[Matrix, Matrix]:
    """(Q⁻¹, U) with Q = UᵀU, both (m, m). Raises LinAlgError if Q is not positive definite."""
    U = sla.cholesky(Q, check_finite=False)
    inverse, info = lapack.dpotri(U)
    if info != 0:
        raise np.linalg.LinAlgError(f"dpotri returned {info}")
    inverse += np.triu(inverse, 1).T  # below the diagonal it is zero, as U is
    return inverse, U
