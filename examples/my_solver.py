"""A template for a solver of your own: copy it, replace its method, delete the steps that you do not need.

    python -m harness check --plugin examples/my_solver.py       says what is wrong with it
    python -m harness run --plugin examples/my_solver.py --size 4386 --out results/mine

The method here, Hildreth's (Naval Res. Logist. Q. 4, 1957), is projected Gauss–Seidel on the dual form:

    min ½ λᵀQ λ − pᵀλ,  λ ≥ 0:    λᵢ ← max(0, λᵢ − (Qλ − p)ᵢ / Qᵢᵢ),  i = 1 … m, again and again

Only `solve` is required. All arrays that a solver is given are read-only and shared: copy before writing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from solvers.base import Answer, Batch, LoadCase, Problem, Solver, WarmStart


class MySolver(Solver):
    #: The forms that it takes: "dual" as above, "primal" min ½xᵀKx − fᵀx, Aᵀx ≤ g.
    forms = ("dual",)

    #: If a package does the solving: its distribution's name, whose version goes into the rows.
    distribution = None

    def __init__(self, max_sweeps: int = 100_000) -> None:
        """Options are keyword arguments, given in a suite as `options = { max_sweeps = 1000 }`.

        Raise ValueError on a value that is not allowed: before anything is measured, it becomes a message.
        """
        if max_sweeps < 1:
            raise ValueError("max_sweeps must be at least 1")
        self.max_sweeps = max_sweeps

    def convert(self, problem: Problem) -> Any:
        """Once per assembly, timed as convert_s: the matrices in a library's own format.

        problem.Q (m, m) in mm/N; in the primal form problem.blocks, the diagonal blocks of K, and
        problem.assembly.A (n, m). problem.assembly.contact_nodes (m, 2) in mm, None if unknown. For an
        adapter that takes every form as min ½zᵀPz + qᵀz, Gz ≤ h or z ≥ 0: solvers/adapter.py.
        """
        return np.ascontiguousarray(problem.Q)

    def prepare(self, data: Any) -> Any:
        """Once per assembly, timed as prepare_s: factorisations, and all else that load cases share."""
        Q = data
        return Q, 1 / np.diag(Q)

    def setup(self, state: Any, load: LoadCase, tolerance: float) -> Any:
        """Once per load case, timed as setup_s: the first of a series, and each that is solved by itself.

        state : from `prepare`, unchanged for the cases after this one.
        load : f (n,) in N, g (m,) in mm, and in the dual form p (m,) in mm.
        """
        return state, np.zeros(len(load.p))

    def update(self, state: Any, ready: Any, load: LoadCase, tolerance: float, start: WarmStart) -> Any:
        """Instead of `setup` for a further load case: start.lam (m,) in N is the answer of a similar one."""
        return state, start.lam.copy()

    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
        """Once per load case, timed as solve_s.

        tolerance : how far the optimality conditions may be violated, in the solver's own sense; here the
        largest step of a sweep, as the displacement Qᵢᵢ|Δλᵢ| in mm. The status is "solved" if that was
        reached, else "iteration_limit", "inaccurate" or "failed"; the harness judges the answer itself.
        """
        (Q, inverse), lam = ready
        lam = lam.copy()
        for k in range(self.max_sweeps):
            largest = 0.0
            for i in range(len(lam)):
                new = max(0.0, lam[i] - (Q[i] @ lam - load.p[i]) * inverse[i])
                largest = max(largest, abs(new - lam[i]) / inverse[i])
                lam[i] = new
            if largest <= tolerance / 10:
                return Answer("solved", lam, iterations=k + 1)
        return Answer("iteration_limit", lam, iterations=self.max_sweeps)

    def batched(self, state: Any) -> Batch | None:
        """A function that takes many load cases at once and returns their answers in the same order.

        Delete it, or return None, if there is nothing to gain. Here: what cases share is what `state` holds.
        """

        def solve_all(loads: Sequence[LoadCase], tolerance: float) -> list[Answer]:
            return [self.solve(self.setup(state, load, tolerance), load, tolerance) for load in loads]

        return solve_all
