"""Active-set Newton on the sparse form: Q by its products, sweeps with a banded M ≈ Q⁻¹.

M comes from the compliance between neighbouring contacts, which the band factor of a coarser model gives
without the rest of Q. A sweep is one product with Q, a solution with K's factors (see `batched`). What the
sweeps do not settle, and a K without a band, is solved by block principal pivoting with a sparse
factorisation of K per contact set (see `augmented_sets`); with many contacts from a set that ever stiffer
springs approach (see `approached_set`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from problems.forms.approximate_inverse import FEW
from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.forms.prepared import Prepared
from problems.forms.problem import Problem
from problems.stiffness.block import NotPositiveDefinite
from solvers.base import Answer, Batch, WarmStart, failed
from solvers.sparse_dual import with_p, with_x

from .approached_set import approached_set
from .augmented_sets import AugmentedSets
from .batched import BatchedSweeps, Case
from .bordered_factor import Set
from .solve import solve_from

MAX_SWEEPS = 100
SETS_PER_SWEEP = 12  # contact sets tried with M before the next product with Q; a front moves a row a set
TARGET = 0.02  # of the tolerance: |y_C| that needs no further sweep; x can be off by some hundred times that
STALLED, STALLED_MM = 3, 1e-8  # sweeps that do not halve |y_C|, at an |y_C| that can be rounding


@dataclass(frozen=True)
class SparseState:
    """A K in the sparse form, and what its load cases share. diagonal : of Q, mm/N."""

    prepared: Prepared
    diagonal: Vector
    sweeps: BatchedSweeps | None
    max_sets: int
    start: WarmStart | None = None

    @classmethod
    def of(cls, problem: Problem, max_sets: int) -> SparseState | Answer:
        """M and the factors of K; a failed answer if K is not positive definite."""
        prepared = problem.prepared
        assembly = prepared.assembly
        try:
            _ = prepared.assembly.K.factors
        except NotPositiveDefinite as error:
            return failed(f"K is not positive definite: {error}")
        approximate = prepared.approximate_inverse
        if approximate is None:
            return cls(prepared, np.ones(assembly.m), None, max_sets)
        M, diagonal = approximate.M, approximate.diagonal
        state = cls(prepared, diagonal, None, max_sets)
        Q = prepared.compliance
        sweeps = SparseSweeps(
            Q, diagonal, M, state.by_sets, MAX_SWEEPS, SETS_PER_SWEEP, inf, prepared=prepared
        )
        return replace(state, sweeps=sweeps)

    def by_sets(self, C: Set | None, load: LoadCase, tolerance: float) -> Answer:
        """Block pivoting from C, or from all contacts that overlap. load : with p."""

        def gap(lam: Vector) -> Vector:
            return self.prepared.gaps(lam[:, None], [load])[:, 0]

        sets = AugmentedSets(self.prepared, load.p, self.diagonal, gap)
        return solve_from(load.p > 0 if C is None else C, sets, tolerance, self.max_sets)

    def solve(self, load: LoadCase, tolerance: float) -> Answer:
        """The answer with x."""
        given = with_p(self.prepared, [load])[0]
        if self.sweeps is None:
            C = approached_set(self.prepared, given) if self.prepared.assembly.m > FEW else None
            return with_x(self.prepared, [self.by_sets(C, given, tolerance)], [load], tolerance)[0]
        if self.start is None:
            case = self.sweeps.cold(given, tolerance)
        else:
            (before,) = with_p(self.prepared, [self.start.load])
            case = self.sweeps.warm(self.sweeps.case_of(self.start, before), given, tolerance)
        (answer,) = with_x(self.prepared, [self.sweeps.answer(case, given, tolerance)], [load], tolerance)
        if answer.status == "solved" or answer.lam is None or not case.settled:
            return answer
        (other,) = with_x(self.prepared, [self.by_sets(answer.lam > 0, given, tolerance)], [load], tolerance)
        return min(answer, other, key=lambda each: each.details["kkt_residual_mm"])

    def batched(self) -> Batch | None:
        if self.sweeps is None:
            return None
        sweeps = self.sweeps

        def solve(loads: Sequence[LoadCase], tolerance: float) -> list[Answer]:
            answers = sweeps(with_p(self.prepared, loads), tolerance)
            for case in sweeps.last:
                case.factor = None  # a band as large as M for each; the next cases have other sets
            return with_x(self.prepared, answers, loads, tolerance)

        return solve


@dataclass(kw_only=True)
class SparseSweeps(BatchedSweeps):
    """Sweeps with y = g − AᵀK⁻¹(f − Aλ), computed in every one: the rounding of K⁻¹ is nearly the same for
    nearly the same λ, and stalls nothing.
    """

    prepared: Prepared

    def gaps(self, lam: Matrix, loads: Sequence[LoadCase]) -> Matrix:
        return self.prepared.gaps(lam, loads)

    def gaps_at(self, cases: Sequence[Case], forces: Sequence[Vector]) -> list[Vector]:
        return list(self.gaps(self.numbered(forces), [case.load for case in cases])[self.M.order].T)

    def enough(self, case: Case, tolerance: float) -> float:
        """Also what some sweeps have not made smaller, as the rounding of K⁻¹: whether that is enough is said
        by the refined x.
        """
        rounding = case.trial.rounding
        if rounding <= TARGET * tolerance or (case.stalled and rounding <= tolerance):
            return tolerance
        return STALLED_MM if case.stalled >= STALLED else -1.0

    def pay(self, cases: Sequence[Case]) -> bool:
        """Always: the alternative is a factorisation per contact set."""
        return True
