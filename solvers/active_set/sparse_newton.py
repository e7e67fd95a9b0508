"""Active-set Newton on the sparse form: Q by its products, sweeps with a banded M ≈ Q⁻¹.

M comes from the compliance between neighbouring contacts, which the band factor of a coarser model gives
without the rest of Q. A sweep is one product with Q, a solution with K's factors (see `batched`). What the
sweeps do not settle, and a K without a band, is solved by block principal pivoting with a sparse
factorisation of K per contact set (see `augmented_sets`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.forms.problem import Problem, stacked
from problems.forms.sparse_factor import NotPositiveDefinite
from problems.forms.sparse_prepared import SparsePrepared
from solvers.base import Answer, Batch, WarmStart, failed
from solvers.kkt import EPS
from solvers.linear_algebra.banded_inverse import BandedInverse, Contacts, Windows, of_windows

from .augmented_sets import AugmentedSets
from .batched import RESIDUAL_TARGET, BatchedSweeps, Case
from .bordered_factor import Set
from .contact_sets import TrialSolution
from .solve import solve_from

MAX_SWEEPS = 100


@dataclass(frozen=True)
class SparseState:
    """A problem in the sparse form, and what its load cases share. diagonal : of Q, mm/N."""

    problem: Problem
    prepared: SparsePrepared
    diagonal: Vector
    sweeps: BatchedSweeps | None
    max_sets: int
    start: WarmStart | None = None

    @classmethod
    def of(cls, problem: Problem, max_sets: int) -> SparseState | Answer:
        """M and the factors of K; a failed answer if K is not positive definite."""
        prepared = problem.prepared
        assert isinstance(prepared, SparsePrepared)
        assembly = prepared.assembly
        try:
            _ = prepared.sparse_factors
        except NotPositiveDefinite as error:
            return failed(f"K is not positive definite: {error}")
        M, diagonal = _banded(prepared)
        if diagonal is None:
            diagonal = np.ones(assembly.m)
        state = cls(problem, prepared, diagonal, None, max_sets)
        if M is None:
            return state
        Q = prepared.compliance
        sweeps = SparseSweeps(Q, diagonal, M, state.by_sets, MAX_SWEEPS, prepared=prepared)
        return replace(state, sweeps=sweeps)

    def by_sets(self, C: Set | None, load: LoadCase, tolerance: float) -> Answer:
        """Block pivoting from C, or from all contacts that overlap. load : with p."""

        def gap(lam: Vector) -> Vector:
            return gaps(self.prepared, lam[:, None], [load])[:, 0]

        sets = AugmentedSets(self.prepared, load.p, self.diagonal, gap)
        return solve_from(load.p > 0 if C is None else C, sets, tolerance, self.max_sets)

    def solve(self, load: LoadCase, tolerance: float) -> Answer:
        """The answer with x."""
        given = self._with_p([load])[0]
        if self.sweeps is None:
            answer = self.by_sets(None, given, tolerance)
        elif self.start is None:
            answer = self.sweeps.answer(self.sweeps.cold(given, tolerance), given, tolerance)
        else:
            solved = self._solved(self.start, self.sweeps.M.order)
            answer = self.sweeps.answer(self.sweeps.warm(solved, given, tolerance), given, tolerance)
        return self._with_x([answer], [load], tolerance)[0]

    def batched(self) -> Batch | None:
        if self.sweeps is None:
            return None
        sweeps = self.sweeps

        def solve(loads: Sequence[LoadCase], tolerance: float) -> list[Answer]:
            return self._with_x(sweeps(self._with_p(loads), tolerance), loads, tolerance)

        return solve

    def _solved(self, start: WarmStart, order: Contacts) -> Case:
        load = self._with_p([start.load])[0]
        trial = TrialSolution(start.lam[order], start.gap[order], 0.0)
        return Case(load, load.p[order], self.diagonal[order] * trial.lam > trial.y, trial)

    def _with_p(self, loads: Sequence[LoadCase]) -> list[LoadCase]:
        """With p = AᵀK⁻¹f − g, (m,) mm; K⁻¹f is computed once if they share their f."""
        columns = self.prepared.dual_load(stacked(loads)).T
        return [LoadCase(load.f, load.g, p) for load, p in zip(loads, columns, strict=True)]

    def _with_x(self, answers: Sequence[Answer], loads: Sequence[LoadCase], tolerance: float) -> list[Answer]:
        """With x = K⁻¹(f − Aλ) refined by δ, and judged by it: "solved" if the KKT residual of y = g − Aᵀx is
        at most max(tolerance, 4ε max(|g| + |A|ᵀ|x|) + max|A|ᵀ|δ|).
        """
        known = [k for k, answer in enumerate(answers) if answer.lam is not None]
        found = list(answers)
        if not known:
            return found
        assembly, cases = self.prepared.assembly, stacked([loads[k] for k in known])
        lam = np.column_stack([np.asarray(answers[k].lam) for k in known])
        b = cases.f - assembly.A @ lam
        x = self.prepared.solve_K(b)
        delta = self.prepared.solve_K(b - assembly.multiply_K(x))
        x = x + delta
        y, size = cases.g - assembly.A.T @ x, abs(assembly.A).T
        rounding = 4 * EPS * (abs(cases.g) + size @ abs(x)).max(axis=0) + (size @ abs(delta)).max(axis=0)
        missed = np.where(lam > 0, abs(y), -y).max(axis=0, initial=0.0)
        for column, k in enumerate(known):
            status, residual = found[k].status, float(missed[column])
            if status in ("solved", "inaccurate"):
                status = "solved" if residual <= max(tolerance, rounding[column]) else "inaccurate"
            details = found[k].details | {"kkt_residual_mm": residual}
            if status == "solved":
                details.pop("cause", None)
            elif "cause" not in details:
                details["cause"] = f"rounding: optimal only to {residual:.1e} mm"
            found[k] = replace(found[k], status=status, x=x[:, column], details=details)
        return found


@dataclass
class SparseSweeps(BatchedSweeps):
    """Sweeps with y = g − AᵀK⁻¹(f − Aλ): Qλ and p alone can be large, and cancel."""

    prepared: SparsePrepared | None = None

    def gaps(self, lam: Matrix, loads: Sequence[LoadCase]) -> Matrix:
        assert self.prepared is not None
        return gaps(self.prepared, lam, loads)

    def settled(self, case: Case, tolerance: float, stagnating: bool) -> bool:
        """Far below the tolerance; or no longer smaller, and below it or the rounding of Qλ − p."""
        rounding, size = case.trial.rounding, abs(case.p) + abs(case.trial.y + case.p)
        within = max(tolerance, 4 * EPS * float(size.max(initial=0.0)))
        return rounding <= RESIDUAL_TARGET * tolerance or (stagnating and rounding <= within)

    def pay(self, cases: Sequence[Case]) -> bool:
        """Always: the alternative is a factorisation per contact set."""
        return True


def gaps(prepared: SparsePrepared, lam: Matrix, loads: Sequence[LoadCase]) -> Matrix:
    """y = g − AᵀK⁻¹(f − Aλ), (m, k) mm."""
    A, cases = prepared.assembly.A, stacked(loads)
    y: Matrix = cases.g - A.T @ prepared.solve_K(cases.f - A @ lam)
    return y


def _banded(prepared: SparsePrepared) -> tuple[BandedInverse | None, Vector | None]:
    """M and the diagonal of Q; None where K has no band, or where Q_WW is not positive definite."""
    assembly = prepared.assembly
    windows = Windows.of(assembly.contact_nodes, assembly.m)
    near = prepared.near_compliance(windows.contacts())
    if near is None:
        return None, None
    diagonal = np.empty(assembly.m)
    for _, start, stop in windows.ranges():
        line = windows.order[start:stop]
        diagonal[line] = np.diag(near.submatrix(line))
    try:
        return of_windows(windows, near.submatrix), diagonal
    except np.linalg.LinAlgError:
        return None, diagonal
