"""λ and y of the dual problem for a sequence of contact sets C: λ = 0 off C, y = Qλ − p = 0 on C.

    C at most half of the contacts:   Q_CC λ_C = p_C                        y = Qλ − p
    C more than half, N the rest:     (Q⁻¹)_NN y_N = −(Q⁻¹p)_N              λ = Q⁻¹(p + y)

So each factored matrix has at most half the order, and each set takes one product with Q or Q⁻¹.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.forms.product import product

from .bordered_factor import BorderedFactor, Set

#: A border wider than this fraction of the base costs about as much as a new factorisation.
MAX_BORDER = 1 / 8


@dataclass(frozen=True)
class TrialSolution:
    """λ (m,) N, zero off the set, y (m,) mm, and the estimated rounding error on the active set, mm."""

    lam: Vector
    y: Vector
    rounding: float


class Principal:
    """G_SS u_S = b_S for a sequence of sets S, refactored when S differs too much from the base."""

    def __init__(self, G: Matrix) -> None:
        self.G = G
        self.factor = BorderedFactor(G, np.zeros(len(G), dtype=bool))
        self.factorisations = 0

    def move_to(self, S: Set) -> None:
        if self.factor.changes(S) <= MAX_BORDER * self.factor.rows.size:
            self.factor.move_to(S)
        else:
            self.factor = BorderedFactor(self.G, S)
            self.factorisations += 1


class _Closed(Principal):
    """The unknowns are λ_C, G = Q."""

    def __init__(self, Q: Matrix, p: Vector) -> None:
        super().__init__(Q)
        self.p = p

    def at(self, C: Set) -> TrialSolution:
        self.move_to(C)
        lam = self.factor.solve(self.p)
        return trial_of(self.G, self.p, C, lam)

    def correction(self, r: Vector) -> Vector:
        return self.factor.solve(r)


class _Open(Principal):
    """The unknowns are y_N, G = Q⁻¹."""

    def __init__(self, inverse: Matrix, p: Vector, compliance: Vector) -> None:
        super().__init__(inverse)
        self.unconstrained = product(inverse, p)
        self.compliance = compliance

    def at(self, C: Set) -> TrialSolution:
        self.move_to(~C)
        y = -self.factor.solve(self.unconstrained)
        lam = self.unconstrained + product(self.G, y)
        rounding = float((self.compliance * abs(lam))[~C].max(initial=0.0))
        return TrialSolution(np.where(C, lam, 0.0), y, rounding)

    def correction(self, r: Vector) -> Vector:
        v = product(self.G, r)
        return v - product(self.G, self.factor.solve(v))


class ContactSets:
    """inverse : returns Q⁻¹; if None, Q_CC is factored whatever the size of C."""

    def __init__(self, Q: Matrix, p: Vector, inverse: Callable[[], Matrix] | None = None) -> None:
        self.Q, self.p, self.inverse = Q, p, inverse
        self.compliance = np.diag(Q).copy()
        self.closed = _Closed(Q, p)
        self.open: _Open | None = None

    @property
    def factorisations(self) -> int:
        return self.closed.factorisations + (self.open.factorisations if self.open else 0)

    def at(self, C: Set) -> TrialSolution:
        self.system: _Open | _Closed = self.closed
        if self.inverse is not None and 2 * int(C.sum()) > len(C):
            self.open = self.open or _Open(self.inverse(), self.p, self.compliance)
            self.system = self.open
        return self.system.at(C)

    def refined(self, C: Set, trial: TrialSolution, target: float) -> TrialSolution:
        """λ_C of the last `at`, refined against Q itself until |y_C| ≤ target mm or no longer halves."""
        if self.system is self.open:
            trial = trial_of(self.Q, self.p, C, trial.lam)
        while trial.rounding > target:
            correction = self.system.correction(np.where(C, -trial.y, 0.0))
            before, trial = trial, trial_of(self.Q, self.p, C, np.where(C, trial.lam + correction, 0.0))
            if trial.rounding > before.rounding / 2:
                return min(before, trial, key=lambda each: each.rounding)
        return trial


def trial_of(Q: Matrix, p: Vector, C: Set, lam: Vector) -> TrialSolution:
    """The trial solution with forces λ: y = Qλ − p, and max|y_C| as its rounding error."""
    y = product(Q, lam) - p
    return TrialSolution(lam, y, float(abs(y[C]).max(initial=0.0)))
