"""Newton systems (Q + D) v = b by a factor in single precision, refined in double precision.

Q is scaled to a unit diagonal first, for the range of float32; D needs no scaling, because Cholesky's
factor does not care. Half the time and half the memory of a double factor; each refinement takes one
product with Q.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import blas, lapack

from problems.forms.assembly import Matrix, Vector
from solvers.interior_point.newton_system import Direct, Solved

from .product import product

LARGEST = 1e30  # on the diagonal


class SinglePrecision:
    """Iterative refinement until ‖b − Hv‖₂ ≤ tolerance · ‖b‖₂, by `Direct` once that no longer halves."""

    def __init__(self, Q: Matrix) -> None:
        self.Q = Q
        self.compliance = np.diag(Q).copy()
        self.T = 1.0 / np.sqrt(self.compliance)
        self.scaled = np.array(Q, dtype=np.float32, order="F")
        self.scaled *= self.T.astype(np.float32)
        self.scaled *= self.T.astype(np.float32)[:, None]
        self.exact = Direct(Q)
        self.begin()

    def begin(self) -> None:
        """A new load case."""
        self.exact.begin()
        self.D = np.full(len(self.Q), np.nan)
        self.single = True
        self.made = 0

    @property
    def factorisations(self) -> int:
        return self.made + self.exact.factorisations

    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        if self.single:
            solved = self._refined(D, b, tolerance)
            if solved.converged:
                return solved
            self.single = False
        return self.exact.solve(D, b, tolerance, limit)

    def _refined(self, D: Vector, b: Vector, tolerance: float) -> Solved:
        try:
            self._factor(D)
        except np.linalg.LinAlgError:
            return Solved(b, 0, False)
        v, r, steps = np.zeros_like(b), b, 0
        size = before = float(np.linalg.norm(b))
        while before > tolerance * size:
            scaled = (self.T * r / before).astype(np.float32)
            scaled = blas.strsv(self.L, scaled, lower=1, overwrite_x=True)
            v = v + before * self.T * blas.strsv(self.L, scaled, lower=1, trans=1)
            r = b - (product(self.Q, v) + D * v)
            steps, left = steps + 1, float(np.linalg.norm(r))
            if not left <= before / 2:
                return Solved(v, steps, False)
            before = left
        return Solved(v, steps, True)

    def _factor(self, D: Vector) -> None:
        """T(Q + D)T = LLᵀ with T = diag(Q)^-½."""
        if np.array_equal(D, self.D):
            return
        H = self.scaled.copy(order="F")
        H[np.diag_indices_from(H)] = np.minimum(1.0 + D / self.compliance, LARGEST)
        self.L, info = lapack.spotrf(H, lower=1, clean=False, overwrite_a=True)
        if info:
            raise np.linalg.LinAlgError(f"the leading minor {info} is not positive in single precision")
        self.D = D
        self.made += 1
