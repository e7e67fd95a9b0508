"""SciPy's L-BFGS-B on the dual form, as a user would call it: objective, gradient and the bounds λ ≥ 0.

R. H. Byrd, P. Lu, J. Nocedal and C. Zhu, SIAM J. Sci. Comput. 16:1190–1208, 1995. It stops at a projected
gradient max|λ − max(λ − y, 0)| ≤ tolerance, in which a force in N stands beside a gap in mm: "solved"; or
when the objective no longer changes in its last digit, which it also calls a success: "inaccurate".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import minimize

from problems.forms.assembly import Vector
from solvers.adapter import Converted, dense
from solvers.base import Answer, Form, LoadCase, Problem, Solver, Status, WarmStart
from solvers.settings import require

LIMIT = 1_000_000  # iterations, and products with Q


@dataclass(kw_only=True, frozen=True, eq=False)
class LBfgsB(Solver):
    """It starts from λ = 0 or a warm start. maxcor : pairs of vectors in the approximate Hessian."""

    forms: ClassVar[tuple[Form, ...]] = ("dual",)
    distribution: ClassVar[str | None] = "scipy"

    maxcor: int = 10

    def __post_init__(self) -> None:
        valid = type(self.maxcor) is int and self.maxcor >= 1
        require("l-bfgs-b", vars(self), maxcor=(valid, "must be a whole number from 1"))

    def convert(self, problem: Problem) -> Converted:
        return Converted(problem, dense(problem.blocks))

    def setup(self, state: Converted, load: LoadCase, tolerance: float) -> tuple[Converted, Vector]:
        return state, np.zeros_like(load.p)

    def update(
        self, state: Converted, ready: object, load: LoadCase, tolerance: float, start: WarmStart
    ) -> tuple[Converted, Vector]:
        return state, np.maximum(start.lam, 0.0)

    def solve(self, ready: tuple[Converted, Vector], load: LoadCase, tolerance: float) -> Answer:
        state, start = ready

        def objective(lam: Vector) -> tuple[float, Vector]:
            """½λᵀQλ − pᵀλ, N·mm, and its gradient y = Qλ − p, mm."""
            y = state.P @ lam - load.p
            return float(lam @ (y - load.p)) / 2, y

        found = minimize(
            objective,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=[(0.0, None)] * len(load.p),
            options={
                "ftol": 0.0,
                "gtol": tolerance,
                "maxcor": self.maxcor,
                "maxiter": LIMIT,
                "maxfun": LIMIT,
            },
        )
        message = str(found.message)
        details = {"products": int(found.nfev), "message": message}
        status: Status = "iteration_limit" if found.status == 1 else "inaccurate"
        if found.success and "PROJECTED GRADIENT" in message:
            status = "solved"
        return state.answer(status, tolerance, found.x, None, iterations=found.nit, details=details)
