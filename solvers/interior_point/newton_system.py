"""Solves the Newton systems (Q + D) v = b of the interior-point method for a sequence of D.

D is a positive diagonal that changes from system to system, Q does not: what can be factored once is
factored when the system is made.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import scipy.linalg as sla

from problems.forms.assembly import Matrix, Vector
from problems.forms.product import product

from .conjugate_gradients import Solved


class NewtonSystem(ABC):
    """Q (m, m), with H = Q + D. factorisations : those that the D of the current load case took."""

    def __init__(self, Q: Matrix) -> None:
        self.Q = Q
        self.begin()

    def begin(self) -> None:
        """Start a new load case."""
        self.D = np.full(len(self.Q), np.nan)
        self.factorisations = 0

    @abstractmethod
    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        """v with Hv = b to the tolerance, in at most `limit` inner iterations."""

    def take(self, D: Vector) -> None:
        """Take D ≥ 0, (m,), unless it is the one before."""
        if not np.array_equal(D, self.D):
            self.factorisations += self.update(D)
            self.D = D

    def update(self, D: Vector) -> int:
        """Factor what depends on D; returns the number of factorisations."""
        return 0

    def times_H(self, v: Vector) -> Vector:
        return product(self.Q, v) + self.D * v


class Direct(NewtonSystem):
    """A Cholesky factorisation of H for every D."""

    def update(self, D: Vector) -> int:
        H = np.array(self.Q, order="F")
        H[np.diag_indices_from(H)] += D
        self.factor = sla.cho_factor(H, overwrite_a=True, check_finite=False)
        return 1

    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        self.take(D)
        return Solved(sla.cho_solve(self.factor, b, check_finite=False), 0, True)
