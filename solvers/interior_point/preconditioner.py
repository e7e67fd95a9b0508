"""Preconditioners V for conjugate gradients on H = Q + D, which work with V⁻ᵀHV⁻¹.

The paper's is V = U + √D (eq. 15) with Q = UᵀU; the others are there for comparison.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray
from scipy.linalg import blas

from problems.forms.assembly import Matrix, Vector


class Preconditioner(ABC):
    """V for one D at a time."""

    @abstractmethod
    def update(self, D: Vector) -> int:
        """Take a new D ≥ 0, (m,); returns the number of factorisations it took."""

    @abstractmethod
    def multiply(self, v: Vector) -> Vector:
        """V⁻ᵀHV⁻¹ v."""

    @abstractmethod
    def to_transformed(self, b: Vector) -> Vector:
        """V⁻ᵀ b."""

    @abstractmethod
    def from_transformed(self, z: Vector) -> Vector:
        """V⁻¹ z."""


class Identity(Preconditioner):
    """V = I: no preconditioning."""

    def __init__(self, Q: Matrix) -> None:
        self.Q = np.asfortranarray(Q)
        self.D = np.zeros(len(Q))

    def update(self, D: Vector) -> int:
        self.D = D
        return 0

    def multiply(self, v: Vector) -> Vector:
        return blas.dsymv(1.0, self.Q, v) + self.D * v

    def to_transformed(self, b: Vector) -> Vector:
        return b

    def from_transformed(self, z: Vector) -> Vector:
        return z


class CholeskyFactor(Preconditioner):
    """V = U: the Cholesky factor of Q, which ignores D."""

    def __init__(self, Q: Matrix) -> None:
        self.U = np.asfortranarray(sla.cholesky(Q, check_finite=False))
        self.D = np.zeros(len(Q))

    def update(self, D: Vector) -> int:
        self.D = D
        return 0

    def multiply(self, v: Vector) -> Vector:
        return v + self.to_transformed(self.D * self.from_transformed(v))

    def to_transformed(self, b: Vector) -> Vector:
        return blas.dtrsv(self.U, b, trans=1)

    def from_transformed(self, z: Vector) -> Vector:
        return blas.dtrsv(self.U, z)


class CholeskyPlusRoot(Preconditioner):
    """V = U + S with S = √D: upper triangular, and exact if D is zero or dominates.

    VᵀV = H + UᵀS + SU, so λmin(V⁻ᵀHV⁻¹) ≥ 1/2; the largest eigenvalue has no such bound. If D → ∞
    on a set B and D → 0 on the rest I, the spectrum tends to 1 and 1 + eig(U_II⁻ᵀ U_BIᵀ U_BI U_II⁻¹),
    with U_BI = 0 if B comes last in the order of the nodes.

    Parameters
    ----------
    Q : (m, m)
    order : (m,) the order in which the nodes are eliminated; as they are numbered if None.
    """

    def __init__(self, Q: Matrix, order: NDArray[np.intp] | None = None) -> None:
        self.order = order
        permuted = Q if order is None else Q[np.ix_(order, order)]
        self.V = np.asfortranarray(sla.cholesky(permuted, check_finite=False))
        self.diagonal = np.diag(self.V).copy()
        self.S = np.zeros(len(Q))

    def update(self, D: Vector) -> int:
        self.S = np.sqrt(D if self.order is None else D[self.order])
        np.fill_diagonal(self.V, self.diagonal + self.S)
        return 0

    def multiply(self, v: Vector) -> Vector:
        """V⁻ᵀHV⁻¹ v by two triangular solves and no product with Q.

        H = VᵀV − VᵀS − SV + 2S² gives, with t = V⁻¹v,  v − St − V⁻ᵀ(Sv − 2S²t): Eisenstat's trick
        (SIAM J. Sci. Stat. Comput. 2:1–4, 1981), which saves a third of the memory traffic.
        """
        t = blas.dtrsv(self.V, v)
        St = self.S * t
        return v - St - blas.dtrsv(self.V, self.S * (v - 2.0 * St), trans=1)

    def to_transformed(self, b: Vector) -> Vector:
        return blas.dtrsv(self.V, b if self.order is None else b[self.order], trans=1)

    def from_transformed(self, z: Vector) -> Vector:
        v = blas.dtrsv(self.V, z)
        if self.order is None:
            return v
        out = np.empty_like(v)
        out[self.order] = v
        return out


class Splitting(Preconditioner):
    """V = √diag(D_B + q_BB) ⊕ chol(Q_II + D_I), where B = {i : D_i > q_ii} and I is the rest.

    The splitting of Oliveira and Sorensen (Linear Algebra Appl. 394:1–24, 2005) by small and large D,
    adapted to constraints λ ≥ 0. It takes a new factorisation for each D.
    """

    def __init__(self, Q: Matrix) -> None:
        self.Q = np.asfortranarray(Q)
        self.diagonal = np.diag(Q).copy()

    def update(self, D: Vector) -> int:
        self.D = D
        self.I = np.flatnonzero(self.diagonal >= D)
        self.root = np.sqrt(D + self.diagonal)
        block = self.Q[np.ix_(self.I, self.I)]
        block[np.diag_indices_from(block)] += D[self.I]
        self.U = np.asfortranarray(sla.cholesky(block, overwrite_a=True, check_finite=False))
        return 1

    def multiply(self, v: Vector) -> Vector:
        t = self.from_transformed(v)
        return self.to_transformed(blas.dsymv(1.0, self.Q, t) + self.D * t)

    def to_transformed(self, b: Vector) -> Vector:
        return self._blockwise(b, trans=1)

    def from_transformed(self, z: Vector) -> Vector:
        return self._blockwise(z, trans=0)

    def _blockwise(self, b: Vector, trans: int) -> Vector:
        out = b / self.root
        if self.I.size:
            out[self.I] = blas.dtrsv(self.U, b[self.I], trans=trans)
        return out
