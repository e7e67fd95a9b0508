"""Active-set Newton on a dense Q: sweeps with a banded M ≈ Q⁻¹, which need no factorisation of Q.

A sweep is one product with Q (see `batched`). Few closed contacts have a small Q_CC, and block principal
pivoting from the solutions on nested subsets is faster; it also solves what the sweeps do not settle, with
Q⁻¹ made when it is first needed, and every case where M is no approximation of Q⁻¹.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.forms.banded_inverse import BandedInverse, banded_inverse
from problems.forms.problem import Problem
from solvers.base import Answer, Batch, WarmStart
from solvers.linear_algebra.approximate_inverse import approximate_inverse
from solvers.linear_algebra.inverse import inverse_with_factor
from solvers.linear_algebra.product import product

from .batched import MIN_CLOSED, BatchedSweeps
from .block_pivoting import block_pivoting
from .bordered_factor import Set
from .contact_sets import ContactSets
from .nested import Cells, cells_of, representatives
from .solve import Identified, solve_or_identify

WIDTHS = (4, 2)  # of the cells, in contacts
COARSE_PASSES = 4  # on each subset, which only needs an approximate solution
MAX_WARM_CHANGES = 1 / 8  # of the contacts: with more changes, a warm start is no better than the subsets


class DenseQ:
    """Q, and its inverse, made when first needed. Raises LinAlgError if Q is not positive definite."""

    def __init__(self, Q: Matrix) -> None:
        self.Q = Q

    @cached_property
    def inverse(self) -> Matrix:
        return inverse_with_factor(self.Q)[0]


@dataclass(frozen=True)
class DenseState:
    """A problem in the dual form, and what its load cases share.

    identified : for cases in which pivoting makes no progress. sweeps : None where M is no good.
    """

    data: DenseQ
    nodes: Matrix | None
    cells: tuple[Cells, ...]
    max_sets: int
    identified: Identified
    sweeps: BatchedSweeps | None = None
    start: WarmStart | None = None

    @classmethod
    def of(cls, problem: Problem, nested: bool, max_sets: int, identified: Identified) -> DenseState:
        """M, or else Q⁻¹. Raises LinAlgError if Q is not positive definite."""
        Q, nodes = problem.Q, problem.assembly.contact_nodes
        cells = tuple(cells_of(nodes, len(Q), width) for width in WIDTHS) if nested else ()
        state = cls(DenseQ(Q), nodes, cells, max_sets, identified)
        M = approximate_inverse(Q, nodes)
        if M is None:
            _ = state.data.inverse
            return state
        return replace(state, sweeps=state._sweeps(M))

    def batched(self) -> Batch:
        return self.sweeps or self._sweeps(banded_inverse(self.data.Q, self.nodes))

    def solve(self, load: LoadCase, tolerance: float) -> Answer:
        C, coarse, products = self._first_guess(load.p, tolerance)
        if self.sweeps is None or C.mean() < MIN_CLOSED:
            return replace(self._by_sets(C, load, tolerance), inner_iterations=coarse)
        if self.start is not None:
            return self._warm(self.start, load, tolerance)
        answer = self.sweeps.answer(self.sweeps.cold(load, tolerance), load, tolerance)
        if "products" in answer.details:
            answer.details["products"] += products
        return answer

    def solve_from(self, C: Set, lam: Vector, load: LoadCase, tolerance: float) -> Answer:
        """From a contact set and the forces λ on it, (m,) N."""
        if self.sweeps is None or C.mean() < MIN_CLOSED:
            return self._by_sets(C, load, tolerance)
        lam = np.where(C, lam, 0.0)
        return self._warm(WarmStart(load, lam, product(self.data.Q, lam) - load.p), load, tolerance)

    def _warm(self, start: WarmStart, load: LoadCase, tolerance: float) -> Answer:
        assert self.sweeps is not None
        case = self.sweeps.warm(self.sweeps.case_of(start, start.load), load, tolerance)
        return self.sweeps.answer(case, load, tolerance)

    def _sweeps(self, M: BandedInverse) -> BatchedSweeps:
        def solve_one(C: Set | None, load: LoadCase, tolerance: float) -> Answer:
            if C is None:
                C, _, _ = self._first_guess(load.p, tolerance)
            return self._by_sets(C, load, tolerance)

        return BatchedSweeps(self.data.Q, np.diag(self.data.Q), M, solve_one)

    def _by_sets(self, C: Set, load: LoadCase, tolerance: float) -> Answer:
        sets = ContactSets(self.data.Q, load.p, lambda: self.data.inverse)
        return solve_or_identify(C, sets, tolerance, self.max_sets, self.identified)

    def _first_guess(self, p: Vector, tolerance: float) -> tuple[Set, int, int]:
        """The contact set of the warm start, else of the finest subset; the number of sets tried on subsets,
        and of products with Q.

        Without a warm start and if sweeps follow, the first subset on which not few are closed is enough.
        """
        Q, tried, products = self.data.Q, 0, 0
        if self.start is not None:
            lam, y = self.start.lam, self.start.gap + self.start.load.p - p  # Qλ − p
            C = np.diag(Q) * lam > y
            if (C ^ (lam > 0)).sum() <= MAX_WARM_CHANGES * len(p):
                return C, tried, products
        C = p > 0
        for cells in self.cells:
            rows = representatives(cells, p)
            sets = ContactSets(Q.T[np.ix_(rows, rows)].T, p[rows])
            found = block_pivoting(sets.at, C[rows], sets.compliance, tolerance, COARSE_PASSES)
            tried += found.passes
            lam = np.zeros(len(p))
            lam[rows] = np.where(found.C, np.maximum(found.trial.lam, 0.0), 0.0)
            C = (lam > 0) | (product(Q, lam) < p)
            products += 1
            if self.sweeps is not None and C.mean() >= MIN_CLOSED:
                break
        if tried and 2 * found.C.sum() > len(found.C):  # few open contacts: small factors of Q⁻¹
            C = p > 0
        return C, tried, products
