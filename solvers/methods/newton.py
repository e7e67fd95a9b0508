"""An active-set Newton method for the dual problem min ½λᵀQλ − pᵀλ, λ ≥ 0.

    λ ≥ 0,   y = Qλ − p ≥ 0,   λᵀy = 0

For a guess C of the contact set, the linear equations λ_N = 0, y_C = 0 are solved and every index with a
wrong sign changes sides: Newton's method on min(λ, y) = 0 (Hintermüller, Ito and Kunisch, SIAM J.
Optim. 13:865–888, 2002), made finite by block principal pivoting. The first guess comes from the
solutions on a sixteenth and a quarter of the contacts, whose matrices are principal submatrices of Q; if
most of the quarter are closed, it is all contacts that overlap.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import numpy as np

from problems.errors import InputError
from problems.forms.assembly import Matrix, Vector
from solvers.active_set.batched import BatchedSweeps
from solvers.active_set.block_pivoting import MAX_SINGLE_EXCHANGES, block_pivoting
from solvers.active_set.bordered_factor import Set
from solvers.active_set.contact_sets import ContactSets
from solvers.active_set.nested import Cells, cells_of, representatives
from solvers.active_set.solve import solve_from
from solvers.base import Answer, Batch, Form, LoadCase, Problem, Solver, WarmStart, failed
from solvers.interior_point.identify import identified_set
from solvers.linear_algebra.banded_inverse import banded_inverse
from solvers.linear_algebra.inverse import inverse_with_factor
from solvers.linear_algebra.product import product

if TYPE_CHECKING:
    from solvers.active_set.sparse_newton import SparseState

WIDTHS = (4, 2)  # of the cells, in contacts
COARSE_PASSES = 4  # on each subset, which only needs an approximate solution
MAX_WARM_CHANGES = 1 / 8  # of the contacts: with more changes, a warm start is no better than the subsets


@dataclass(frozen=True)
class _Ready:
    problem: Problem
    inverse: Matrix
    cells: tuple[Cells, ...]
    start: WarmStart | None = None


State: TypeAlias = "_Ready | SparseState | Answer"


class ActiveSetNewton(Solver):
    """Active-set Newton with nested starts.

    Stops when, with λ_C refined against Q, no q_ii λ_i and no y_i is below −max(tolerance, 10 × rounding)
    mm. Negative λ are then set to 0: "solved" if max(max(−y), max_{λ>0} |y|) ≤ max(tolerance,
    4ε max(|p| + |Q|λ)) mm, else "inaccurate". Iterations are the contact sets tried on all contacts, inner
    iterations those on the subsets.

    Options
    -------
    nested : start from the subsets; if false, from C = {p > 0}. In a series, a warm start that changes at
        most an eighth of the contacts takes precedence.
    max_sets : limit on the contact sets tried.
    """

    forms: ClassVar[tuple[Form, ...]] = ("dual", "sparse")

    def __init__(self, *, nested: bool = True, max_sets: int = 1000) -> None:
        if max_sets < 1:
            raise InputError.one("newton", "max_sets", max_sets, "must be at least 1")
        self.nested = nested
        self.max_sets = max_sets

    def prepare(self, data: Problem) -> State:
        """Q⁻¹, and the cells; a failed answer if Q, or K in the sparse form, is not positive definite."""
        if data.form == "sparse":
            from solvers.active_set.sparse_newton import SparseState  # not in the other forms

            return SparseState.of(data, self.max_sets)
        assembly = data.assembly
        widths = WIDTHS if self.nested else ()
        cells = tuple(cells_of(assembly.contact_nodes, assembly.m, width) for width in widths)
        try:
            return _Ready(data, inverse_with_factor(data.Q)[0], cells)
        except np.linalg.LinAlgError as error:
            return failed(f"Q is not positive definite: {error}")

    def update(
        self,
        state: State,
        ready: State,
        load: LoadCase,
        tolerance: float,
        start: WarmStart,
    ) -> State:
        """The first guess comes from the warm start."""
        return state if isinstance(state, Answer) else replace(state, start=start)

    def batched(self, state: State) -> Batch | None:
        """Sweeps with a banded M ≈ Q⁻¹; unsettled cases are solved as in `solve`."""
        if isinstance(state, Answer):
            return None
        if not isinstance(state, _Ready):
            return state.batched()
        Q, nodes, inverse = state.problem.Q, state.problem.assembly.contact_nodes, state.inverse

        def solve_one(C: Set | None, load: LoadCase, tolerance: float) -> Answer:
            if C is None:
                C, _ = _first_guess(state, load.p, tolerance)
            sets = ContactSets(Q, load.p, inverse)
            return self._settled(solve_from(C, sets, tolerance, self.max_sets), sets, tolerance)

        return BatchedSweeps(Q, np.diag(Q), banded_inverse(Q, nodes), solve_one)

    def solve(self, ready: State, load: LoadCase, tolerance: float) -> Answer:
        if isinstance(ready, Answer):
            return ready
        try:
            if not isinstance(ready, _Ready):
                return ready.solve(load, tolerance)
            C, coarse = _first_guess(ready, load.p, tolerance)
            sets = ContactSets(ready.problem.Q, load.p, ready.inverse)
            answer = self._settled(solve_from(C, sets, tolerance, self.max_sets), sets, tolerance)
        except np.linalg.LinAlgError as error:
            return failed(str(error))
        return replace(answer, inner_iterations=coarse)

    def _settled(self, answer: Answer, sets: ContactSets, tolerance: float) -> Answer:
        """The answer; if its sets made no progress, from the set that an interior point identifies."""
        if answer.status == "solved" or answer.details["single_exchanges"] < MAX_SINGLE_EXCHANGES:
            return answer
        again = solve_from(identified_set(sets.Q, sets.p), sets, tolerance, self.max_sets)
        if again.details["kkt_residual_mm"] > answer.details["kkt_residual_mm"]:
            return answer
        tried = (answer.iterations or 0) + (again.iterations or 0)
        return replace(again, iterations=tried, details=again.details | {"interior_point": True})


def _first_guess(ready: _Ready, p: Vector, tolerance: float) -> tuple[Set, int]:
    """The contact set of the warm start, else of the finest subset; the number of sets tried on subsets."""
    Q, tried = ready.problem.Q, 0
    if ready.start is not None:
        lam, y = ready.start.lam, ready.start.gap + ready.start.load.p - p  # Qλ − p
        C = np.diag(Q) * lam > y
        if (C ^ (lam > 0)).sum() <= MAX_WARM_CHANGES * len(p):
            return C, tried
    C = p > 0
    for cells in ready.cells:
        rows = representatives(cells, p)
        sets = ContactSets(Q.T[np.ix_(rows, rows)].T, p[rows])
        found = block_pivoting(sets.at, C[rows], sets.compliance, tolerance, COARSE_PASSES)
        tried += found.passes
        lam = np.zeros(len(p))
        lam[rows] = np.where(found.C, np.maximum(found.trial.lam, 0.0), 0.0)
        C = (lam > 0) | (product(Q, lam) < p)
    if tried and 2 * found.C.sum() > len(found.C):  # few open contacts: small factors of Q⁻¹
        C = p > 0
    return C, tried
