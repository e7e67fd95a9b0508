"""Active-set Newton on a dense Q: sweeps with a banded M ≈ Q⁻¹, which need no factorisation of Q.

A sweep is one product with Q (see `batched`). Few closed contacts have a small Q_CC, and block principal
pivoting from the solutions on nested subsets is faster; it also solves what the sweeps do not settle, with
Q⁻¹ made when it is first needed. Where Q does not decay along the joint, M is no approximation of Q⁻¹: this
is noticed by a few steps e ← e − MQe, and every case is solved by pivoting.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.forms.banded_inverse import WINDOW_LINES, BandedInverse, Windows, banded_inverse
from problems.forms.problem import Problem
from solvers.base import Answer, Batch, WarmStart
from solvers.interior_point.identify import identified_set
from solvers.linear_algebra.inverse import inverse_with_factor
from solvers.linear_algebra.product import product

from .batched import MIN_CLOSED, BatchedSweeps, Case
from .block_pivoting import MAX_SINGLE_EXCHANGES, block_pivoting
from .bordered_factor import Set
from .contact_sets import ContactSets, TrialSolution
from .nested import Cells, cells_of, representatives
from .solve import solve_from

WIDTHS = (4, 2)  # of the cells, in contacts
COARSE_PASSES = 4  # on each subset, which only needs an approximate solution
MAX_WARM_CHANGES = 1 / 8  # of the contacts: with more changes, a warm start is no better than the subsets
WIDEST_WINDOW = 1 / 4  # of the contacts: a wider one costs as much as Q⁻¹
STEPS, CONTRACTION = 3, 0.5  # of e ← e − MQe, and what the last one must achieve


class DenseQ:
    """Q, and its inverse, made when first needed. Raises LinAlgError if Q is not positive definite."""

    def __init__(self, Q: Matrix) -> None:
        self.Q = Q

    @cached_property
    def inverse(self) -> Matrix:
        return inverse_with_factor(self.Q)[0]


@dataclass(frozen=True)
class DenseState:
    """A problem in the dual form, and what its load cases share. sweeps : None where M is no good."""

    data: DenseQ
    nodes: Matrix | None
    cells: tuple[Cells, ...]
    max_sets: int
    sweeps: BatchedSweeps | None = None
    start: WarmStart | None = None

    @classmethod
    def of(cls, problem: Problem, nested: bool, max_sets: int) -> DenseState:
        """M, or else Q⁻¹. Raises LinAlgError if Q is not positive definite."""
        Q, nodes = problem.Q, problem.assembly.contact_nodes
        cells = tuple(cells_of(nodes, len(Q), width) for width in WIDTHS) if nested else ()
        state = cls(DenseQ(Q), nodes, cells, max_sets)
        M = useful_banded_inverse(Q, nodes)
        if M is None:
            _ = state.data.inverse
            return state
        return replace(state, sweeps=state._sweeps(M))

    def batched(self) -> Batch:
        return self.sweeps or self._sweeps(banded_inverse(self.data.Q, self.nodes))

    def solve(self, load: LoadCase, tolerance: float) -> Answer:
        C, coarse = self._first_guess(load.p, tolerance)
        if self.sweeps is None or C.mean() < MIN_CLOSED:
            answer = self._by_sets(C, load, tolerance)
            return replace(answer, inner_iterations=coarse)
        if self.start is None:
            case = self.sweeps.cold(load, tolerance)
        else:
            case = self.sweeps.warm(self._solved(self.start), load, tolerance)
        return self.sweeps.answer(case, load, tolerance)

    def _sweeps(self, M: BandedInverse) -> BatchedSweeps:
        def solve_one(C: Set | None, load: LoadCase, tolerance: float) -> Answer:
            if C is None:
                C, _ = self._first_guess(load.p, tolerance)
            return self._by_sets(C, load, tolerance)

        return BatchedSweeps(self.data.Q, np.diag(self.data.Q), M, solve_one)

    def _by_sets(self, C: Set, load: LoadCase, tolerance: float) -> Answer:
        """Block pivoting from C; without progress, from the set that an interior point identifies."""
        sets = ContactSets(self.data.Q, load.p, lambda: self.data.inverse)
        answer = solve_from(C, sets, tolerance, self.max_sets)
        if answer.status == "solved" or answer.details["single_exchanges"] < MAX_SINGLE_EXCHANGES:
            return answer
        again = solve_from(identified_set(sets.Q, sets.p), sets, tolerance, self.max_sets)
        if again.details["kkt_residual_mm"] > answer.details["kkt_residual_mm"]:
            return answer
        tried = (answer.iterations or 0) + (again.iterations or 0)
        return replace(again, iterations=tried, details=again.details | {"interior_point": True})

    def _solved(self, start: WarmStart) -> Case:
        assert self.sweeps is not None
        order = self.sweeps.M.order
        trial = TrialSolution(start.lam[order], start.gap[order], 0.0)
        C = self.sweeps.diagonal[order] * trial.lam > trial.y
        return Case(start.load, start.load.p[order], C, trial)

    def _first_guess(self, p: Vector, tolerance: float) -> tuple[Set, int]:
        """The contact set of the warm start, else of the finest subset; the number of sets tried on subsets.

        Without a warm start and if sweeps follow, the first subset on which not few are closed is enough.
        """
        Q, tried = self.data.Q, 0
        if self.start is not None:
            lam, y = self.start.lam, self.start.gap + self.start.load.p - p  # Qλ − p
            C = np.diag(Q) * lam > y
            if (C ^ (lam > 0)).sum() <= MAX_WARM_CHANGES * len(p):
                return C, tried
        C = p > 0
        for cells in self.cells:
            rows = representatives(cells, p)
            sets = ContactSets(Q.T[np.ix_(rows, rows)].T, p[rows])
            found = block_pivoting(sets.at, C[rows], sets.compliance, tolerance, COARSE_PASSES)
            tried += found.passes
            lam = np.zeros(len(p))
            lam[rows] = np.where(found.C, np.maximum(found.trial.lam, 0.0), 0.0)
            C = (lam > 0) | (product(Q, lam) < p)
            if self.sweeps is not None and C.mean() >= MIN_CLOSED:
                break
        if tried and 2 * found.C.sum() > len(found.C):  # few open contacts: small factors of Q⁻¹
            C = p > 0
        return C, tried


def useful_banded_inverse(Q: Matrix, nodes: Matrix | None) -> BandedInverse | None:
    """M if its sweeps converge fast; None if Q does not decay along the joint, or is small.

    Raises LinAlgError if Q is not positive definite.
    """
    m = len(Q)
    if (WINDOW_LINES + 1) * Windows.of(nodes, m).across > WIDEST_WINDOW * m:
        return None
    M = banded_inverse(Q, nodes)
    e, sizes = np.random.default_rng(0).standard_normal(m), []
    for _ in range(STEPS):
        e[M.order] -= M.product(product(Q, e)[M.order])
        sizes.append(float(np.linalg.norm(e)))
    return M if sizes[-1] <= CONTRACTION * sizes[-2] else None
