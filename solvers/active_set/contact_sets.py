"""λ and y of the dual problem for one contact set C after another: λ = 0 off it, y = Qλ − p = 0 on it.

    C at most half of the contacts:   Q_CC λ_C = p_C                        y = Qλ − p
    C more than half, N the rest:     (Q⁻¹)_NN y_N = −(Q⁻¹p)_N              λ = Q⁻¹(p + y)

So no matrix of more than half the order is factored, and each set takes one product with Q or Q⁻¹.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Matrix, Vector
from solvers.linear_algebra.product import product

from .bordered_factor import BorderedFactor, Set

#: A border of more than this share of the base costs about what a factorisation of its own does.
BORDER = 1 / 8


@dataclass(frozen=True)
class Trial:
    """λ (m,) N, zero off the set, y (m,) mm, and by what rounding leaves of the set's zeros, mm."""

    lam: Vector
    y: Vector
    rounding: float


class _Principal:
    """G_SS u_S = b_S for one S after another, factored anew when S has moved far."""

    def __init__(self, G: Matrix) -> None:
        self.G = G
        self.factor = BorderedFactor(G, np.zeros(len(G), dtype=bool))
        self.factorisations = 0

    def move_to(self, S: Set) -> None:
        if self.factor.changes(S) <= BORDER * self.factor.rows.size:
            self.factor.move_to(S)
        else:
            self.factor = BorderedFactor(self.G, S)
            self.factorisations += 1


class _Closed(_Principal):
    """The unknowns are λ_C, G = Q."""

    def __init__(self, Q: Matrix, p: Vector) -> None:
        super().__init__(Q)
        self.p = p

    def at(self, C: Set) -> Trial:
        self.move_to(C)
        lam = self.factor.solve(self.p)
        return gaps(self.G, self.p, C, lam)

    def correction(self, r: Vector) -> Vector:
        return self.factor.solve(r)


class _Open(_Principal):
    """The unknowns are y_N, G = Q⁻¹."""

    def __init__(self, inverse: Matrix, p: Vector, compliance: Vector) -> None:
        super().__init__(inverse)
        self.unconstrained = product(inverse, p)
        self.compliance = compliance

    def at(self, C: Set) -> Trial:
        self.move_to(~C)
        y = -self.factor.solve(self.unconstrained)
        lam = self.unconstrained + product(self.G, y)
        rounding = float((self.compliance * abs(lam))[~C].max(initial=0.0))
        return Trial(np.where(C, lam, 0.0), y, rounding)

    def correction(self, r: Vector) -> Vector:
        v = product(self.G, r)
        return v - product(self.G, self.factor.solve(v))


class ContactSets:
    """inverse : Q⁻¹; without it Q_CC is factored however large C is."""

    def __init__(self, Q: Matrix, p: Vector, inverse: Matrix | None = None) -> None:
        self.Q, self.p = Q, p
        self.compliance = np.diag(Q).copy()
        self.closed = _Closed(Q, p)
        self.open = None if inverse is None else _Open(inverse, p, self.compliance)

    @property
    def factorisations(self) -> int:
        return self.closed.factorisations + (self.open.factorisations if self.open else 0)

    def at(self, C: Set) -> Trial:
        self.by = self.open if self.open and 2 * int(C.sum()) > len(C) else self.closed
        return self.by.at(C)

    def refined(self, C: Set, trial: Trial, enough: float) -> Trial:
        """λ_C of the last `at` refined against Q itself, until |y_C| ≤ enough mm or no longer halves."""
        if self.by is self.open:
            trial = gaps(self.Q, self.p, C, trial.lam)
        while trial.rounding > enough:
            correction = self.by.correction(np.where(C, -trial.y, 0.0))
            before, trial = trial, gaps(self.Q, self.p, C, np.where(C, trial.lam + correction, 0.0))
            if trial.rounding > before.rounding / 2:
                return min(before, trial, key=lambda each: each.rounding)
        return trial


def gaps(Q: Matrix, p: Vector, C: Set, lam: Vector) -> Trial:
    """The trial of λ: y = Qλ − p, and max|y_C| as its rounding."""
    y = product(Q, lam) - p
    return Trial(lam, y, float(abs(y[C]).max(initial=0.0)))
