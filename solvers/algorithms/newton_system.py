"""Newton systems (Q + D) v = b of the interior-point method for a sequence of D.

D is a positive diagonal that changes from system to system, Q does not: what can be factored once is
factored when the system is made.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from problems.forms.assembly import Matrix, Vector
from problems.forms.banded_inverse import BandedInverse
from problems.stiffness.dense_block import product


@dataclass(frozen=True)
class Solved:
    """The solution v, the iterations spent on it, and whether the tolerance was met."""

    v: Vector
    iterations: int
    converged: bool


def conjugate_gradients(
    multiply: Callable[[Vector], Vector],
    b: Vector,
    tolerance: float,
    max_iterations: int,
    precondition: Callable[[Vector], Vector] = lambda r: r,
) -> Solved:
    """Hestenes and Stiefel's method for Hv = b, H positive definite, from v = 0 until ‖r‖ ≤ tolerance·‖b‖.

    r = b − Hv is the recursive residual, ‖r‖² = rᵀP⁻¹r. precondition : r → P⁻¹r. Stops unconverged after
    max_iterations, or at a direction without positive curvature, which means that rounding dominates.
    """
    v = np.zeros_like(b)
    r = b.copy()
    s = precondition(r)
    d = s.copy()
    rho = float(r @ s)
    target = tolerance**2 * rho
    for k in range(max_iterations):
        if rho <= target:
            return Solved(v, k, True)
        Hd = multiply(d)
        curvature = float(d @ Hd)
        if not curvature > 0:
            return Solved(v, k, False)
        alpha = rho / curvature
        v += alpha * d
        r -= alpha * Hd
        s = precondition(r)
        rho, last_rho = float(r @ s), rho
        d = s + (rho / last_rho) * d
    return Solved(v, max_iterations, rho <= target)


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
        """Take D ≥ 0, (m,), unless it is unchanged."""
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


class Banded(NewtonSystem):
    """Conjugate gradients until rᵀP⁻¹r ≤ tolerance² bᵀP⁻¹b with r = b − (Q + D) v; nothing of order m³.

    The preconditioner is P = M⁻¹ + D with a banded M ≈ Q⁻¹, and with S = √D

        P⁻¹ = S⁻¹ (I + SMS)⁻¹ S M,

    one band factorisation per D. P ≈ H for any D: late in the iteration, D is huge at open gaps and tiny at
    closed ones, and the spectrum of P⁻¹H stays within that of MQ and 1.
    """

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
