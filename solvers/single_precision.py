"""Newton systems (Q + D) v = b by a factor in single precision, refined in double precision.

H = Q + D is scaled to a unit diagonal first, because float32 has 24 bits and cond(Q) takes as many.
Half the time and half the memory of a double factor; each refinement takes one product with Q.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla

from problems.assembly import Matrix, Vector

from .newton_system import Direct, Solved


class SinglePrecision:
    """Iterative refinement until ‖b − Hv‖₂ ≤ tolerance · ‖b‖₂, by `Direct` once that no longer halves."""

    def __init__(self, Q: Matrix) -> None:
        self.Q = Q
        self.compliance = np.diag(Q).copy()
        root = np.sqrt(self.compliance).astype(np.float32)
        self.scaled = np.array(Q, dtype=np.float32, order="F")
        self.scaled /= root
        self.scaled /= root[:, None]
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
            v = v + before * self.T * sla.cho_solve((self.U, False), scaled, check_finite=False)
            r = b - (self.Q @ v + D * v)
            steps, left = steps + 1, float(np.linalg.norm(r))
            if not left <= before / 2:
                return Solved(v, steps, False)
            before = left
        return Solved(v, steps, True)

    def _factor(self, D: Vector) -> None:
        """THT = UᵀU with T = diag(H)^-½."""
        if np.array_equal(D, self.D):
            return
        self.T = 1.0 / np.sqrt(self.compliance + D)
        share = (self.T * np.sqrt(self.compliance)).astype(np.float32)
        H = self.scaled * share
        H *= share[:, None]
        H[np.diag_indices_from(H)] = 1.0
        self.U = sla.cholesky(H, overwrite_a=True, check_finite=False)
        self.D = D
        self.made += 1
