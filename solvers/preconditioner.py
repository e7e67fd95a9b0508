"""The paper's preconditioner V = U + √D for H = Q + D, with Q = UᵀU (eq. 15)."""

from __future__ import annotations

import numpy as np
from scipy.linalg import blas

from problems.assembly import Matrix, Vector


class CholeskyPlusRoot:
    """V = U + S with S = √D: upper triangular, and exact where D is zero or dominates.

    VᵀV = H + UᵀS + SU, so λmin(V⁻ᵀHV⁻¹) ≥ 1/2; the largest eigenvalue has no such bound.

    Parameters
    ----------
    U : (m, m) upper triangular Cholesky factor of Q. One copy is kept, whose diagonal changes with D.
    """

    def __init__(self, U: Matrix) -> None:
        self.diagonal = np.diag(U).copy()
        self.V = np.array(U, order="F")
        self.S = np.zeros(len(U))

    def update(self, D: Vector) -> None:
        """Take a new D ≥ 0, (m,)."""
        self.S = np.sqrt(D)
        np.fill_diagonal(self.V, self.diagonal + self.S)

    def multiply(self, v: Vector) -> Vector:
        """V⁻ᵀHV⁻¹ v by two triangular solves and no product with Q.

        H = VᵀV − VᵀS − SV + 2S² gives, with t = V⁻¹v,  v − St − V⁻ᵀ(Sv − 2S²t): Eisenstat's trick
        (SIAM J. Sci. Stat. Comput. 2:1–4, 1981), which saves a third of the memory traffic.
        """
        t = self.from_transformed(v)
        St = self.S * t
        return v - St - self.to_transformed(self.S * (v - 2.0 * St))

    def to_transformed(self, b: Vector) -> Vector:
        """V⁻ᵀ b."""
        return blas.dtrsv(self.V, b, trans=1)

    def from_transformed(self, z: Vector) -> Vector:
        """V⁻¹ z."""
        return blas.dtrsv(self.V, z)
