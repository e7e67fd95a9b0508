"""An active-set Newton method for the dual problem min ½λᵀQλ − pᵀλ, λ ≥ 0.

    λ ≥ 0,   y = Qλ − p ≥ 0,   λᵀy = 0

For a guess C of the contact set, the linear equations λ_N = 0, y_C = 0 are solved and every index with a
wrong sign changes sides: Newton's method on min(λ, y) = 0 (Hintermüller, Ito and Kunisch, SIAM J.
Optim. 13:865–888, 2002), made finite by block principal pivoting.

The equations are solved with a banded M ≈ Q⁻¹ and corrected by products with Q, if Q decays along the joint
(solvers/active_set/batched.py). For few closed contacts, and otherwise, they are solved as they are: the
first guess then comes from the solutions on a sixteenth and a quarter of the contacts, whose matrices are
principal submatrices of Q; if most of the quarter are closed, it is all contacts that overlap.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import numpy as np

from problems.errors import InputError
from solvers.active_set.dense_newton import DenseState
from solvers.base import Answer, Batch, Form, LoadCase, Problem, Solver, WarmStart, failed
from solvers.interior_point.identify import identified_set

if TYPE_CHECKING:
    from solvers.active_set.sparse_newton import SparseState

State: TypeAlias = "DenseState | SparseState | Answer"


class ActiveSetNewton(Solver):
    """Active-set Newton.

    Pivoting stops when, with λ_C refined against Q, no q_ii λ_i and no y_i is below −max(tolerance,
    10 × rounding) mm. Negative λ are then set to 0: "solved" if max(max(−y), max_{λ>0} |y|) ≤ max(tolerance,
    4ε max(|p| + |Q|λ)) mm, else "inaccurate". Iterations are the contact sets tried on all contacts, inner
    iterations those on the subsets. Sweeps stop at right signs with |y_C| far below the tolerance or within
    rounding; iterations then are products with Q, inner iterations contact sets tried with M.

    Options
    -------
    nested : start from the subsets; if false, from C = {p > 0}. In a series, a warm start that changes at
        most an eighth of the contacts takes precedence. Sweeps start from C = {p > 0} or the warm start.
    max_sets : limit on the contact sets tried on all contacts.
    """

    forms: ClassVar[tuple[Form, ...]] = ("dual", "sparse")

    def __init__(self, *, nested: bool = True, max_sets: int = 1000) -> None:
        if max_sets < 1:
            raise InputError.one("newton", "max_sets", max_sets, "must be at least 1")
        self.nested = nested
        self.max_sets = max_sets

    def prepare(self, data: Problem) -> State:
        """M, or else Q⁻¹; a failed answer if Q, or K in the sparse form, is not positive definite."""
        if data.form == "sparse":
            from solvers.active_set.sparse_newton import SparseState  # not in the other forms

            return SparseState.of(data, self.max_sets)
        try:
            return DenseState.of(data, self.nested, self.max_sets, identified_set)
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
        """Sweeps with a banded M ≈ Q⁻¹; unsettled cases are solved by pivoting."""
        return None if isinstance(state, Answer) else state.batched()

    def solve(self, ready: State, load: LoadCase, tolerance: float) -> Answer:
        if isinstance(ready, Answer):
            return ready
        try:
            return ready.solve(load, tolerance)
        except np.linalg.LinAlgError as error:
            return failed(str(error))
