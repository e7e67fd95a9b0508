"""A template for a solver of your own: copy it, replace its method, delete the steps that you do not need.

    python -m harness check --plugin examples/my_solver.py       says what is wrong with it
    python -m harness run --plugin examples/my_solver.py --size 4386 --out results/mine

The method here is the primal–dual active set (Hintermüller, Ito and Kunisch, SIAM J. Optim. 13, 2002) on the
dual form:

    min ½ λᵀQ λ − pᵀλ,  λ ≥ 0:    Q_CC λ_C = p_C,  λ = 0 outside C
    C ← {i ∈ C : λᵢ > 0} ∪ {i ∉ C : (Qλ − p)ᵢ < 0},   again and again, until C repeats itself

C are the closed contacts. If C repeats itself, λ is the exact answer, up to rounding. The method may cycle
instead; then it stops at the limit of contact sets.

Only `solve` is required. All arrays that a solver is given are read-only and shared: copy before writing.
Lengths and forces, and the tolerance with them, come multiplied by powers of two; for a joint in mm and N
they hardly change.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.linalg as sla

from solvers.base import Answer, Batch, DualLoadCase, Problem, Solver, WarmStart


class MySolver(Solver):
    #: The forms that it takes: "dual" as above; "primal" min ½xᵀKx − fᵀx, Aᵀx ≤ g; "sparse", the same before
    #: condensation.
    forms = ("dual",)

    #: If a package does the solving: its distribution's name, whose version goes into the rows.
    distribution = None

    def __init__(self, max_sets: int = 100) -> None:
        """Options are keyword arguments, given in a suite as `options = { max_sets = 50 }`.

        Raise ValueError on a value that is not allowed: before anything is measured, it becomes a message.
        """
        if max_sets < 1:
            raise ValueError("max_sets must be at least 1")
        self.max_sets = max_sets

    def convert(self, problem: Problem) -> Any:
        """Once per assembly, timed as convert_s: the matrices in a library's own format.

        problem.Q (m, m) in mm/N; in the primal form problem.blocks, the diagonal blocks of K, and
        problem.assembly.A (n, m). problem.assembly.contact_nodes (m, 2) in mm, None if unknown. For an
        adapter that takes every form as min ½zᵀPz + qᵀz, Gz ≤ h or z ≥ 0: solvers/adapter.py.
        """
        return np.ascontiguousarray(problem.Q)

    def prepare(self, data: Any) -> Any:
        """Once per assembly, timed as prepare_s: factorisations, and all else that load cases share."""
        return data

    def setup(self, state: Any, load: DualLoadCase, tolerance: float) -> Any:
        """Once per load case, timed as setup_s: the first of a series, and each that is solved by itself.

        state : from `prepare`, unchanged for the cases after this one.
        load : f (n,) in N, g (m,) in mm, and in the dual form p (m,) in mm.
        """
        return state, load.p > 0  # closed first: the contacts that overlap before any force acts

    def update(self, state: Any, ready: Any, load: DualLoadCase, tolerance: float, start: WarmStart) -> Any:
        """Instead of `setup` for a further load case: start.lam (m,) in N is the answer of a similar one."""
        return state, start.lam > 0

    def solve(self, ready: Any, load: DualLoadCase, tolerance: float) -> Answer:
        """Once per load case, timed as solve_s.

        tolerance : how far the optimality conditions may be violated, in the solver's own sense; a
        method that ends exactly, like this one, does not need it. The status is "solved" if it has ended so,
        else "iteration_limit", "inaccurate" or "failed"; the harness judges the answer itself.
        """
        Q, closed = ready
        for k in range(self.max_sets):
            lam = np.zeros(len(load.p))
            factor = sla.cho_factor(Q[np.ix_(closed, closed)])
            lam[closed] = sla.cho_solve(factor, load.p[closed])
            wanted = np.where(closed, lam > 0, Q @ lam < load.p)
            if np.array_equal(wanted, closed):
                return Answer("solved", lam, iterations=k + 1)
            closed = wanted
        return Answer("iteration_limit", lam, iterations=self.max_sets)

    def batched(self, state: Any) -> Batch | None:
        """A function that takes many load cases at once and returns their answers in the same order.

        Delete it, or return None, if there is nothing to gain. Here: what cases share is what `state` holds.
        """

        def solve_all(loads: Sequence[DualLoadCase], tolerance: float) -> list[Answer]:
            return [self.solve(self.setup(state, load, tolerance), load, tolerance) for load in loads]

        return solve_all
