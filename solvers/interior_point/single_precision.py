"""Newton systems (Q + D) v = b with a factor in single precision, refined in double precision.

Q is first scaled to a unit diagonal, for the range of float32; D needs no scaling, to which a Cholesky
factorisation is insensitive. This takes half the time and memory of a factor in double precision; each
refinement step takes one product with Q.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import blas, lapack

from problems.forms.assembly import Matrix, Vector

from .conjugate_gradients import Solved
from .newton_system import Direct

MAX_DIAGONAL = 1e30  # on the diagonal


class SinglePrecision(Direct):
    """Iterative refinement until ‖b − Hv‖₂ ≤ tolerance · ‖b‖₂; `Direct` once that no longer halves."""

    def __init__(self, Q: Matrix) -> None:
        super().__init__(Q)
        self.compliance = np.diag(Q).copy()
        self.T = 1.0 / np.sqrt(self.compliance)
        self.scaled = np.empty(Q.shape, dtype=np.float32, order="F")
        for j, t in enumerate(self.T):  # column by column, before the cast: Q may be beyond float32
            self.scaled[:, j] = self.T * Q[:, j] * t

    def begin(self) -> None:
        super().begin()
        self.use_single = True

    def update(self, D: Vector) -> int:
        """T(Q + D)T = LLᵀ with T = diag(Q)^-½."""
        if not self.use_single:
            return super().update(D)
        H = self.scaled.copy(order="F")
        H[np.diag_indices_from(H)] = np.minimum(1.0 + D / self.compliance, MAX_DIAGONAL)
        self.L, info = lapack.spotrf(H, lower=1, clean=False, overwrite_a=True)
        if info:
            raise np.linalg.LinAlgError(f"the leading minor {info} is not positive in single precision")
        return 1

    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        if self.use_single:
            solved = self._refined(D, b, tolerance)
            if solved.converged:
                return solved
            self.use_single, self.D = False, np.full_like(D, np.nan)
        return super().solve(D, b, tolerance, limit)

    def _refined(self, D: Vector, b: Vector, tolerance: float) -> Solved:
        try:
            self.take(D)
        except np.linalg.LinAlgError:
            return Solved(b, 0, False)
        v, r, steps = np.zeros_like(b), b, 0
        size = previous = float(np.linalg.norm(b))
        while previous > tolerance * size:
            scaled = (self.T * r / previous).astype(np.float32)
            scaled = blas.strsv(self.L, scaled, lower=1, overwrite_x=True)
            v = v + previous * self.T * blas.strsv(self.L, scaled, lower=1, trans=1)
            r = b - self.times_H(v)
            steps, norm = steps + 1, float(np.linalg.norm(r))
            if not norm <= previous / 2:
                return Solved(v, steps, False)
            previous = norm
        return Solved(v, steps, True)
