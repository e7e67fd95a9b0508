"""Many load cases of the dual problem at once: their products with Q are one product of matrices.

    λ ≥ 0,   y = Qλ − p ≥ 0,   λᵀy = 0

With a banded M ≈ Q⁻¹ each case is solved in sweeps. From (λ, y) the next point solves the problem in which
Q is replaced by M⁻¹ but y is right where it stands: y⁺ = y + M⁻¹(λ⁺ − λ), or

    λ⁺ = (λ − My) + My⁺ ≥ 0,   y⁺ ≥ 0,   λ⁺ᵀy⁺ = 0,

by block principal pivoting with band factorisations, which cost next to nothing. Then y = Qλ⁺ − p for all
cases in one product. The error shrinks by max|1 − eig(MQ)| a sweep, a tenth on a joint of plates. A case
begins with its distance to a solved one, not with p, which is large where a load presses on soft parts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import blas

from problems.forms.assembly import Matrix, Vector
from solvers.base import Answer, LoadCase
from solvers.kkt import EPS, checked
from solvers.linear_algebra.banded_inverse import BandedInverse, BandFactor
from solvers.linear_algebra.product import product

from .block_pivoting import block_pivoting, wrong_signs
from .bordered_factor import Set
from .contact_sets import Trial

SWEEPS = 20  # for an error that shrinks by half each time, and then some
SETS = 3  # tried a sweep: M is not worth more
DOUBT = 1e-5  # of |y_C| before a sweep: signs that it cannot tell
ENOUGH = 0.1  # of the tolerance: |y_C| that needs no further sweep

FEW = 1 / 16  # of the contacts

#: Solves one case from a contact set, or None for a guess of its own: (C, p, tolerance).
Alone = Callable[[Set | None, Vector, float], Answer]


@dataclass
class Case:
    """A load case on its way, in the order of the banded inverse.

    p : (m,) mm. C : its contact set. trial : λ (m,) N and y = Qλ − p (m,) mm. factor : M's, of the open set.
    settled : no sign is wrong, and |y_C| is far below the tolerance or what rounding leaves.
    """

    p: Vector
    C: Set
    trial: Trial
    factor: BandFactor | None = None
    settled: bool = False
    sweeps: int = 0
    sets: int = 0


@dataclass
class BatchedSweeps:
    """Q (m, m), M ≈ Q⁻¹. last : the cases solved before, from which the next ones begin.

    alone : for cases that are not settled; for all of them, once that were most of a call's, or few contacts
        are closed: then their own equations are quickly solved.
    """

    Q: Matrix
    M: BandedInverse
    alone: Alone
    last: list[Case] = field(default_factory=list)
    of_use: bool = True

    def __call__(self, loads: Sequence[LoadCase], tolerance: float) -> list[Answer]:
        """An answer to each load. Iterations are products with Q, inner iterations sets tried with M."""
        p = [load.p[self.M.order] for load in loads]
        if not self.last:
            zero = np.zeros(len(self.Q))
            unloaded = Case(zero, zero > 0, Trial(zero, zero, 0.0))
            self.last = self._swept([_from(unloaded, p[0])], tolerance)
            self.of_use = worth_it(self.last)
        if not self.of_use:
            return [self.alone(None, load.p, tolerance) for load in loads]
        self.last = self._swept([_from(nearest(self.last, each), each) for each in p], tolerance)
        self.of_use = worth_it(self.last)
        return [self._answer(case, load, tolerance) for case, load in zip(self.last, loads, strict=True)]

    def _swept(self, cases: list[Case], tolerance: float) -> list[Case]:
        order, compliance = self.M.order, np.diag(self.Q)[self.M.order]
        left = cases
        for _ in range(SWEEPS):
            lam = np.empty((len(order), len(left)), order="F")
            for column, case in enumerate(left):
                lam[order, column] = _stepped(case, self.M, compliance, tolerance)
            Qlam = blas.dgemm(1.0, self.Q, lam)
            for column, case in enumerate(left):
                _look(case, lam[order, column], Qlam[order, column], compliance, tolerance)
            left = [case for case in left if not case.settled]
            if not left:
                break
        return cases

    def _answer(self, case: Case, load: LoadCase, tolerance: float) -> Answer:
        order = self.M.order
        if not case.settled:
            C = np.zeros(len(order), dtype=bool)
            C[order] = case.C
            return self.alone(C, load.p, tolerance)
        lam, y = np.empty(len(order)), np.empty(len(order))
        lam[order], y[order] = np.maximum(case.trial.lam, 0.0), case.trial.y
        if (case.trial.lam < 0).any():
            y = product(self.Q, lam) - load.p
        # `checked` has the same rounding with |Q|λ, which takes long.
        status, residual = checked(self.Q, load.p, lam, y, max(tolerance, _rounding(load.p, y)))
        details = {"closed": int(case.C.sum()), "kkt_residual_mm": residual}
        return Answer(status, lam, iterations=case.sweeps, inner_iterations=case.sets, details=details)


class _Banded:
    """λ and y of one contact set after another, with M in the place of Q⁻¹."""

    def __init__(self, M: BandedInverse, start: Trial, factor: BandFactor | None) -> None:
        self.M, self.b, self.factor = M, start.lam - M.product(start.y), factor
        self.doubt = DOUBT * start.rounding

    def at(self, C: Set) -> Trial:
        N = ~C
        if self.factor is None or (self.factor.S ^ N).any():
            self.factor = self.M.factor(N)
        y = -self.factor.solve(self.b)
        return Trial(np.where(C, self.b + self.M.product(y), 0.0), y, self.doubt)


def nearest(cases: Sequence[Case], p: Vector) -> Case:
    """The case whose p is nearest."""
    return min(cases, key=lambda case: float(np.linalg.norm(case.p - p)))


def worth_it(cases: Sequence[Case]) -> bool:
    """Whether sweeps settle such cases, and save something."""
    closed = np.mean([case.C.mean() for case in cases])
    return 2 * sum(case.settled for case in cases) >= len(cases) and bool(closed >= FEW)


def _from(near: Case, p: Vector) -> Case:
    """A case that begins where another one ended."""
    y = near.trial.y + near.p - p
    return Case(p, near.C, Trial(near.trial.lam, y, float(abs(y).max())), near.factor)


def _stepped(case: Case, M: BandedInverse, compliance: Vector, tolerance: float) -> Vector:
    """λ (m,) of the case with M⁻¹ in the place of Q."""
    banded = _Banded(M, case.trial, case.factor)
    found = block_pivoting(banded.at, case.C, compliance, tolerance, SETS)
    case.C, case.factor, case.sets = found.C, banded.factor, case.sets + found.passes
    return found.trial.lam


def _look(case: Case, lam: Vector, Qlam: Vector, compliance: Vector, tolerance: float) -> None:
    """Take λ, and see whether it will do."""
    y = Qlam - case.p
    rounding = float(abs(y[case.C]).max(initial=0.0))
    still = rounding > case.trial.rounding / 2
    case.trial, case.sweeps = Trial(lam, y, rounding), case.sweeps + 1
    if rounding <= max(ENOUGH * tolerance, _rounding(case.p, y)) or (still and rounding <= tolerance):
        case.settled = not wrong_signs(case.C, case.trial, compliance, 0.0).any()


def _rounding(p: Vector, y: Vector) -> float:
    """What the rounding of Qλ − p makes of it, mm."""
    return 4 * EPS * float((abs(p) + abs(y + p)).max(initial=0.0))
