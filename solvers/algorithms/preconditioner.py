"""Newton systems by conjugate gradients on V⁻ᵀHV⁻¹, H = Q + D, with one of several preconditioners V.

The paper's is V = U + √D (eq. 15) with Q = UᵀU; the others are there for comparison.
"""

from dataclasses import replace

import numpy as np
import scipy.linalg as sla
from scipy.linalg import blas

from problems.forms.assembly import Indices, Matrix, Vector

from .newton_system import Direct, NewtonSystem, Solved, conjugate_gradients

#: CG iterations after which a factorisation in a new order pays off. A Cholesky factorisation takes m³/3
#: operations on data in cache, a CG iteration 2m² on data in memory.
REORDER_AFTER = 25


class Preconditioned(NewtonSystem):
    """Conjugate gradients until ‖V⁻ᵀ(b − Hv)‖₂ ≤ tolerance · ‖V⁻ᵀb‖₂; here V = I: no preconditioning."""

    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        self.take(D)
        solved = conjugate_gradients(self.multiply, self.to_transformed(b), tolerance, limit)
        return replace(solved, v=self.from_transformed(solved.v))

    def multiply(self, z: Vector) -> Vector:
        """V⁻ᵀHV⁻¹ z."""
        return self.to_transformed(self.times_H(self.from_transformed(z)))

    def to_transformed(self, b: Vector) -> Vector:
        """V⁻ᵀ b."""
        return b

    def from_transformed(self, z: Vector) -> Vector:
        """V⁻¹ z."""
        return z


class CholeskyFactor(Preconditioned):
    """V = U: the Cholesky factor of Q, which ignores D.

    order : (m,) the order in which the nodes are eliminated; as they are numbered if None.
    """

    def __init__(self, Q: Matrix, order: Indices | None = None) -> None:
        super().__init__(Q)
        self.order = np.arange(len(Q)) if order is None else order
        permuted = Q if order is None else Q[np.ix_(order, order)]
        self.V = np.asfortranarray(sla.cholesky(permuted, check_finite=False))
        self.diagonal = np.diag(self.V).copy()

    def multiply(self, z: Vector) -> Vector:
        return z + self.to_transformed(self.D * self.from_transformed(z))

    def to_transformed(self, b: Vector) -> Vector:
        return blas.dtrsv(self.V, b[self.order], trans=1)

    def from_transformed(self, z: Vector) -> Vector:
        v = np.empty_like(z)
        v[self.order] = blas.dtrsv(self.V, z)
        return v


class CholeskyPlusRoot(CholeskyFactor):
    """V = U + S with S = √D: upper triangular, and exact if D is zero or dominates.

    VᵀV = H + UᵀS + SU, so λmin(V⁻ᵀHV⁻¹) ≥ 1/2; the largest eigenvalue has no such bound. If D → ∞
    on a set B and D → 0 on the rest I, the spectrum tends to 1 and 1 + eig(U_II⁻ᵀ U_BIᵀ U_BI U_II⁻¹),
    with U_BI = 0 if B comes last in the order of the nodes.
    """

    def update(self, D: Vector) -> int:
        self.S = np.sqrt(D[self.order])
        np.fill_diagonal(self.V, self.diagonal + self.S)
        return 0

    def multiply(self, z: Vector) -> Vector:
        """V⁻ᵀHV⁻¹ z by two triangular solves and no product with Q.

        H = VᵀV − VᵀS − SV + 2S² gives, with t = V⁻¹z,  z − St − V⁻ᵀ(Sz − 2S²t): Eisenstat's trick
        (SIAM J. Sci. Stat. Comput. 2:1–4, 1981), which saves a third of the memory traffic.
        """
        St = self.S * blas.dtrsv(self.V, z)
        return z - St - blas.dtrsv(self.V, self.S * (z - 2.0 * St), trans=1)


class OpenLast(NewtonSystem):
    """V = U + √D and the nodes in the order of increasing D, open gaps (large D) last.

    The nodes are reordered, and Q refactored, for the system that follows one of more than REORDER_AFTER CG
    iterations. Each load case begins with the nodes as they are numbered.
    """

    def __init__(self, Q: Matrix) -> None:
        self.first = CholeskyPlusRoot(Q)
        super().__init__(Q)

    def begin(self) -> None:
        super().begin()
        self.V, self.reorder = self.first, False

    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        if self.reorder:
            self.V = CholeskyPlusRoot(self.Q, np.argsort(D, kind="stable"))
            self.factorisations += 1
        solved = self.V.solve(D, b, tolerance, limit)
        self.reorder = solved.iterations > REORDER_AFTER
        return solved


class Splitting(Preconditioned):
    """V = √diag(D_B + q_BB) ⊕ chol(Q_II + D_I), where B = {i : D_i > q_ii} and I is the rest.

    The splitting of Oliveira and Sorensen (Linear Algebra Appl. 394:1–24, 2005) by small and large D,
    adapted to constraints λ ≥ 0. It takes a new factorisation for each D.
    """

    def update(self, D: Vector) -> int:
        diagonal = np.diag(self.Q)
        self.I = np.flatnonzero(diagonal >= D)
        self.root = np.sqrt(D + diagonal)
        block = self.Q[np.ix_(self.I, self.I)]
        block[np.diag_indices_from(block)] += D[self.I]
        self.U = np.asfortranarray(sla.cholesky(block, overwrite_a=True, check_finite=False))
        return 1

    def to_transformed(self, b: Vector) -> Vector:
        return self._blockwise(b, trans=1)

    def from_transformed(self, z: Vector) -> Vector:
        return self._blockwise(z, trans=0)

    def _blockwise(self, b: Vector, trans: int) -> Vector:
        out = b / self.root
        if self.I.size:
            out[self.I] = blas.dtrsv(self.U, b[self.I], trans=trans)
        return out


#: The option `preconditioner`, with the nodes as they are numbered.
SYSTEMS: dict[str, type[NewtonSystem]] = {
    "V": CholeskyPlusRoot,
    "U": CholeskyFactor,
    "none": Preconditioned,
    "splitting": Splitting,
    "direct": Direct,
}
