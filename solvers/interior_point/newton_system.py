"""Solves the Newton systems (Q + D) v = b of the interior-point method for a sequence of D.

D is a positive diagonal that changes from system to system, Q does not: what can be factored once is
factored in `prepare`, when the system is made.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg as sla

from problems.forms.assembly import Matrix, Vector
from solvers.linear_algebra.conjugate_gradients import conjugate_gradients

from .preconditioner import CholeskyFactor, CholeskyPlusRoot, Identity, Preconditioner, Splitting

#: CG iterations after which a factorisation in a new order pays off. A Cholesky factorisation takes m³/3
#: operations on data in cache, a CG iteration 2m² on data in memory.
REORDER_AFTER = 25

#: The most CG iterations per system, in units of m.
CG_LIMIT = 10


@dataclass(frozen=True)
class Solved:
    """v, the CG iterations spent on it, and whether the tolerance was met."""

    v: Vector
    iterations: int
    converged: bool


class NewtonSystem(Protocol):
    """What the iterations need. `factorisations` counts those of the current load case."""

    @property
    def factorisations(self) -> int: ...

    def begin(self) -> None:
        """Start a new load case."""

    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        """v with (Q + D) v = b to the tolerance, in at most `limit` inner iterations."""


class FactoredPerD(ABC):
    """Q (m, m), and something that is factored anew whenever D changes."""

    def __init__(self, Q: Matrix) -> None:
        self.Q = Q
        self.begin()

    def begin(self) -> None:
        """Start a new load case."""
        self.D = np.full(len(self.Q), np.nan)
        self.factorisations = 0

    def take(self, D: Vector) -> None:
        """Factor for D, unless it is the one before."""
        if not np.array_equal(D, self.D):
            self.D = D
            self.factor_for(D)
            self.factorisations += 1

    @abstractmethod
    def factor_for(self, D: Vector) -> None: ...


class Direct(FactoredPerD):
    """A Cholesky factorisation of H = Q + D for every D."""

    def factor_for(self, D: Vector) -> None:
        H = np.array(self.Q, order="F")
        H[np.diag_indices_from(H)] += D
        self.factor = sla.cho_factor(H, overwrite_a=True, check_finite=False)

    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        self.take(D)
        return Solved(sla.cho_solve(self.factor, b, check_finite=False), 0, True)


class Pcg:
    """Conjugate gradients until ‖V⁻ᵀ(b − Hv)‖₂ ≤ tolerance · ‖V⁻ᵀb‖₂."""

    def __init__(self, V: Preconditioner) -> None:
        self.V = V
        self.begin()

    def begin(self) -> None:
        """Start a new load case."""
        self.factorisations = 0

    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        self.factorisations += self.V.update(D)
        limit = min(limit, CG_LIMIT * len(b))
        cg = conjugate_gradients(self.V.multiply, self.V.to_transformed(b), tolerance, limit)
        return Solved(self.V.from_transformed(cg.z), cg.iterations, cg.converged)


class OpenLast(Pcg):
    """PCG with V = U + √D and the nodes in the order of increasing D, open gaps (large D) last.

    The nodes are reordered, and Q refactored, for the system that follows one of more than REORDER_AFTER CG
    iterations. Each load case begins with the nodes as they are numbered.
    """

    def __init__(self, Q: Matrix) -> None:
        self.Q = Q
        self.first = CholeskyPlusRoot(Q)
        super().__init__(self.first)

    def begin(self) -> None:
        super().begin()
        self.V = self.first
        self.reorder = False

    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        if self.reorder:
            self.V = CholeskyPlusRoot(self.Q, np.argsort(D, kind="stable"))
            self.factorisations += 1
        solved = super().solve(D, b, tolerance, limit)
        self.reorder = solved.iterations > REORDER_AFTER
        return solved


#: The option `preconditioner`, with the nodes as they are numbered.
SYSTEMS: dict[str, Callable[[Matrix], NewtonSystem]] = {
    "V": lambda Q: Pcg(CholeskyPlusRoot(Q)),
    "U": lambda Q: Pcg(CholeskyFactor(Q)),
    "none": lambda Q: Pcg(Identity(Q)),
    "splitting": lambda Q: Pcg(Splitting(Q)),
    "direct": Direct,
}
