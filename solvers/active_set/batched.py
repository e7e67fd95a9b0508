"""Batched solution of the dual problem: one matrix–matrix product with Q serves many load cases.

    λ ≥ 0,   y = Qλ − p ≥ 0,   λᵀy = 0

Each case is solved in sweeps with a banded M ≈ Q⁻¹. From (λ, y), the next point solves the problem with Q
replaced by M⁻¹ and y exact at the current λ: y⁺ = y + M⁻¹(λ⁺ − λ), or

    λ⁺ = (λ − My) + My⁺ ≥ 0,   y⁺ ≥ 0,   λ⁺ᵀy⁺ = 0,

by block principal pivoting with band factorisations, whose cost is negligible. Then y + Q(λ⁺ − λ) for all
cases in one product. Each sweep reduces the error by a factor max|1 − eig(MQ)|, about 0.1 on a joint of
plates, and by less on a set that no longer changes, where the sweeps are steps of the conjugate gradient
method with M as preconditioner. A case starts from a solved one and its change in p, since p itself is
large if a load presses on soft parts.

The rounding of a change shrinks with it. That of Qλ⁺ − p does not: M multiplies it in stiff modes, and M's
error carries it into soft ones, up to √cond(Q) times as large, so that the sweeps would stall far above it.
Qλ⁺ − p itself is computed in the last sweep, and decides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.forms.banded_inverse import BandedInverse, BandFactor
from problems.forms.compliance import AnyQ
from solvers.base import Answer, LoadCase, WarmStart
from solvers.kkt import kkt_status, rounding_of
from solvers.linear_algebra.product import products

from .banded_sets import BandedSets
from .block_pivoting import ROUNDING_FACTOR, block_pivoting, wrong_signs
from .bordered_factor import Set
from .contact_sets import TrialSolution

MAX_SWEEPS = 20  # enough even if a sweep only halves the error
SETS_PER_SWEEP = 3  # contact sets per sweep: where a product with Q is cheap, more do not pay off
SIGNS_FROM = 0.1  # of the tolerance: a smaller value has no wrong sign
STEP_RANGE = 0.5, 2.0  # beyond it, a step is rounding
MIN_CLOSED = 1 / 16  # of the contacts: with fewer closed, solving case by case is faster

#: (C, load with p, tolerance) → the answer of one case, from the contact set C, or from a guess of its own if
#: None.
SolveOne = Callable[[Set | None, LoadCase, float], Answer]


@dataclass
class Case:
    """A load case during the sweeps, its vectors in the order of the banded inverse.

    load : the case as it was given. p : (m,) mm. C : its contact set. trial : λ (m,) N and y = Qλ − p (m,)
    mm. factor : of M on the open set. unchanged : its set in the last sweep. before : the step of the last
    sweep and Q times it, if the set was unchanged. anew : y is computed from λ, not by its change; replaced :
    and was by changes in the sweep before. known : |y_C| when it last was computed anew; stalled : how often
    in succession that was not half of the value before. settled : with a y computed anew no sign is wrong,
    and |y_C| is within the tolerance or rounding.
    """

    load: LoadCase
    p: Vector
    C: Set
    trial: TrialSolution
    factor: BandFactor | None = None
    unchanged: bool = False
    before: tuple[Vector, Vector] | None = None
    anew: bool = True
    replaced: bool = False
    known: float = inf
    stalled: int = 0
    settled: bool = False
    sweeps: int = 0
    sets: int = 0


@dataclass
class BatchedSweeps:
    """Q (m, m) or its products, its diagonal, M ≈ Q⁻¹.

    near : of the tolerance: from such a |y_C| one more sweep settles a case, and y is computed anew.
    last : the cases of the previous call, which warm-start the next ones.
    solve_one : for unsettled cases; for all cases, once most of a call's were unsettled or few contacts are
        closed, so that the small systems of each case are faster.
    """

    Q: AnyQ
    diagonal: Vector
    M: BandedInverse
    solve_one: SolveOne
    max_sweeps: int = MAX_SWEEPS
    sets_per_sweep: int = SETS_PER_SWEEP
    near: float = 1.0
    last: list[Case] = field(default_factory=list)
    use_sweeps: bool = True

    def __call__(self, loads: Sequence[LoadCase], tolerance: float) -> list[Answer]:
        """An answer to each load. Iterations are products with Q, inner iterations sets tried with M."""
        if not self.last:
            self.last = [self.cold(loads[0], tolerance)]
            self.use_sweeps = self.pay(self.last)
        if not self.use_sweeps:
            return [self.solve_one(None, load, tolerance) for load in loads]
        started = [_warm_started(nearest(self.last, p), load, p) for load, p in self._ordered(loads)]
        self.last = self._sweep(started, tolerance)
        self.use_sweeps = self.pay(self.last)
        return [self.answer(case, load, tolerance) for case, load in zip(self.last, loads, strict=True)]

    def cold(self, load: LoadCase, tolerance: float) -> Case:
        """The case of a load from nothing; it may be unsettled."""
        p = load.p[self.M.order]
        start = TrialSolution(np.zeros(len(p)), -p, float(abs(p).max()))
        (case,) = self._sweep([Case(load, p, p > 0, start)], tolerance)
        return case

    def warm(self, solved: Case, load: LoadCase, tolerance: float) -> Case:
        """The same from a solved case."""
        ((_, p),) = self._ordered([load])
        (case,) = self._sweep([_warm_started(solved, load, p)], tolerance)
        return case

    def case_of(self, solved: WarmStart, load: LoadCase) -> Case:
        """The case of a load with p that was solved elsewhere."""
        order = self.M.order
        trial = TrialSolution(solved.lam[order], solved.gap[order], 0.0)
        return Case(load, load.p[order], self.diagonal[order] * trial.lam > trial.y, trial)

    def gaps(self, lam: Matrix, loads: Sequence[LoadCase]) -> Matrix:
        """y = Qλ − p, (m, k) mm, of forces λ (m, k) for that many loads."""
        return products(self.Q, lam) - np.column_stack([load.p for load in loads])

    def enough(self, case: Case, tolerance: float) -> float:
        """The KKT residual, mm, of a y computed anew that ends the sweeps of a case: what stalls can be
        rounding, of which long sums leave several times as much.
        """
        rounding = rounding_of(case.p, case.trial.y)
        return max(tolerance, ROUNDING_FACTOR * rounding if case.stalled else rounding)

    def pay(self, cases: Sequence[Case]) -> bool:
        """Whether sweeps settle such cases, and faster than case by case."""
        closed = np.mean([case.C.mean() for case in cases])
        return 2 * sum(case.settled for case in cases) >= len(cases) and bool(closed >= MIN_CLOSED)

    def _ordered(self, loads: Sequence[LoadCase]) -> Iterator[tuple[LoadCase, Vector]]:
        """Each load and its p in the order of M."""
        return ((load, load.p[self.M.order]) for load in loads)

    def _sweep(self, cases: list[Case], tolerance: float) -> list[Case]:
        compliance = self.diagonal[self.M.order]
        unsettled = cases
        for _ in range(self.max_sweeps):
            found = [self._banded_step(case, compliance, tolerance) for case in unsettled]
            for case in unsettled:
                anew = case.trial.rounding <= self.near * tolerance
                case.anew, case.replaced = anew, anew and not case.anew
            for case, lam, y in zip(unsettled, found, self.gaps_at(unsettled, found), strict=True):
                self._update(case, lam, y, compliance, tolerance)
            unsettled = [case for case in unsettled if not case.settled]
            if not unsettled:
                break
        return cases

    def gaps_at(self, cases: Sequence[Case], forces: Sequence[Vector]) -> list[Vector]:
        """y (m,) mm of each case at λ (m,) N, anew or by its change, in one product."""
        pairs = list(zip(cases, forces, strict=True))
        steps = [lam if case.anew else lam - case.trial.lam for case, lam in pairs]
        changes = products(self.Q, self.numbered(steps))[self.M.order].T
        return [
            change - case.p if case.anew else case.trial.y + change
            for case, change in zip(cases, changes, strict=True)
        ]

    def numbered(self, vectors: Sequence[Vector]) -> Matrix:
        """Vectors in the order of M as columns (m, k) in that of Q."""
        columns = np.empty((len(self.M.order), len(vectors)), order="F")
        columns[self.M.order] = np.column_stack(vectors)
        return columns

    def _banded_step(self, case: Case, compliance: Vector, tolerance: float) -> Vector:
        """λ (m,) of the case with Q replaced by M⁻¹; conjugate to the step before on an unchanged set."""
        banded = BandedSets(self.M, case.trial, case.factor)
        found = block_pivoting(banded.at, case.C, compliance, SIGNS_FROM * tolerance, self.sets_per_sweep)
        case.unchanged = not (case.C ^ found.C).any()
        case.C, case.factor, case.sets = found.C, banded.factor, case.sets + found.passes
        if not case.unchanged or case.before is None:
            return found.trial.lam
        step, change = case.before
        return found.trial.lam - ((found.trial.lam - case.trial.lam) @ change / (step @ change)) * step

    def _update(self, case: Case, lam: Vector, y: Vector, compliance: Vector, tolerance: float) -> None:
        """Take λ and y, on an unchanged set at the minimum along the step, and decide whether the case is
        settled. Where y is replaced, its change is not Q times the step.
        """
        step, change = lam - case.trial.lam, y - case.trial.y
        case.before = None
        if case.unchanged and not case.replaced and step @ change > 0:
            share = float(np.clip(-(step @ case.trial.y) / (step @ change), *STEP_RANGE))
            lam, y = case.trial.lam + share * step, case.trial.y + share * change
            case.before = step, change
        rounding = float(abs(y[case.C]).max(initial=0.0))
        if case.anew:
            case.stalled = case.stalled + 1 if rounding > case.known / 2 else 0
            case.known = rounding
        case.trial, case.sweeps = TrialSolution(lam, y, rounding), case.sweeps + 1
        right = not wrong_signs(case.C, case.trial, compliance, 0.0).any()
        residual = max(rounding, float(-y.min(initial=0.0))) + _cut_off(lam, compliance)
        # Of a case with a larger residual the answer would be inaccurate.
        case.settled = case.anew and right and residual <= self.enough(case, tolerance)

    def answer(self, case: Case, load: LoadCase, tolerance: float) -> Answer:
        """The answer of a case; one that is unsettled is solved from its set."""
        order = self.M.order
        if not case.settled:
            C = np.zeros(len(order), dtype=bool)
            C[order] = case.C
            return self.solve_one(C, load, tolerance)
        lam, y = np.empty(len(order)), np.empty(len(order))
        lam[order], y[order] = np.maximum(case.trial.lam, 0.0), case.trial.y
        cut_off = bool((case.trial.lam < 0).any())
        if cut_off:
            y = self.gaps(lam[:, None], [load])[:, 0]
        # `kkt_status` bounds the same rounding by |Q|λ, which is slow to compute.
        status, residual = kkt_status(self.Q, load.p, lam, y, max(tolerance, rounding_of(load.p, y)))
        details: dict[str, Any] = {"closed": int(case.C.sum()), "kkt_residual_mm": residual}
        details["products"] = case.sweeps + cut_off
        if status != "solved":
            details["cause"] = f"rounding: optimal only to {residual:.1e} mm"
        return Answer(status, lam, iterations=case.sweeps, inner_iterations=case.sets, details=details)


def nearest(cases: Sequence[Case], p: Vector) -> Case:
    """The case with the nearest p."""
    return min(cases, key=lambda case: float(np.linalg.norm(case.p - p)))


def _warm_started(solved: Case, load: LoadCase, p: Vector) -> Case:
    """A case that starts from the solution of another one."""
    y = solved.trial.y + solved.p - p
    return Case(load, p, solved.C, TrialSolution(solved.trial.lam, y, float(abs(y).max())), solved.factor)


def _cut_off(lam: Vector, compliance: Vector) -> float:
    """Bound on the change of y = Qλ − p, mm, if forces below zero are set to 0: |q_ij| ≤ √(q_ii q_jj)."""
    root = np.sqrt(compliance)
    return float(root.max(initial=0.0) * (root @ np.maximum(-lam, 0.0)))
