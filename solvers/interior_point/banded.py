"""Newton systems (Q + D) v = b by conjugate gradients with a banded M ≈ Q⁻¹; nothing of order m³.

The preconditioner is P = M⁻¹ + D, and with S = √D

    P⁻¹ = S⁻¹ (I + SMS)⁻¹ S M,

one band factorisation per D. P ≈ H for any D: late in the iteration, D is huge at open gaps and tiny at
closed ones, and the spectrum of P⁻¹H stays within that of MQ and 1.
"""

from __future__ import annotations

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.forms.banded_inverse import BandedInverse

from .conjugate_gradients import Solved, conjugate_gradients
from .newton_system import NewtonSystem


class Banded(NewtonSystem):
    """Conjugate gradients until rᵀP⁻¹r ≤ tolerance² bᵀP⁻¹b with r = b − (Q + D) v."""

    def __init__(self, Q: Matrix, M: BandedInverse) -> None:
        super().__init__(Q)
        self.M = M

    def update(self, D: Vector) -> int:
        self.S = np.sqrt(D[self.M.order])
        self.factor = self.M.shifted_factor(self.S)
        return 1

    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        self.take(D)
        return conjugate_gradients(self.times_H, b, tolerance, limit, self._precondition)

    def _precondition(self, r: Vector) -> Vector:
        z = np.empty_like(r)
        z[self.M.order] = self.factor.solve(self.S * self.M.product(r[self.M.order])) / self.S
        return z
