"""Any other solver that qpsolvers finds, by its name there, https://github.com/qpsolvers/qpsolvers.

The matrices go through qpsolvers.Problem, λ comes back through Solution.z (primal form) or Solution.x
(dual form).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import qpsolvers
import scipy.sparse as sp
from qpsolvers.exceptions import QPError

from problems.errors import InputError
from solvers.base import Answer, Load, Problem, Solver

from .adapter import Converted, answer, blocks_of, dense

#: How each solver takes the absolute tolerance. Relative ones are 0 and iteration limits out of the way.
#: DAQP's own dual tolerance of 1e-12 is not loosened. HiGHS takes no tolerance below 1e-10, and adds 1e-7
#: to the diagonal of P unless told not to: beside eigenvalues of Q near 1e-5 that moved x by 1e-4 mm.
TOLERANCE: dict[str, Callable[[float], dict[str, Any]]] = {
    "daqp": lambda tol: {"primal_tol": tol, "dual_tol": min(tol, 1e-12), "iter_limit": 1_000_000},
    "highs": lambda tol: {
        "primal_feasibility_tolerance": max(tol, 1e-10),
        "dual_feasibility_tolerance": max(tol, 1e-10),
        "qp_regularization_value": 0.0,
    },
    "scs": lambda tol: {"eps_abs": tol, "eps_rel": 0.0, "max_iters": 10_000_000},
}


class QpSolvers(Solver):
    """name : the solver's name in qpsolvers.available_solvers."""

    def __init__(self, name: str) -> None:
        if name not in qpsolvers.available_solvers:
            found = ", ".join(qpsolvers.available_solvers)
            raise InputError.one("qpsolvers", "solver", name, f"one of those that it finds: {found}")
        self.name = name

    def convert(self, problem: Problem) -> Converted:
        rows = problem.assembly.A.T if problem.form == "primal" else None
        # Copies, because some of these solvers refuse read-only arrays.
        if self.name in qpsolvers.dense_solvers:
            P = np.array(dense(blocks_of(problem)), order="C")
            return Converted(problem.form, P, None if rows is None else rows.toarray(order="C"))
        P = sp.block_diag([sp.csc_matrix(block) for block in blocks_of(problem)], format="csc")
        return Converted(problem.form, sp.csc_matrix(P), None if rows is None else sp.csc_matrix(rows))

    def setup(self, state: Converted, load: Load, tolerance: float) -> Any:
        if state.form == "primal":
            return qpsolvers.Problem(state.P, state.q(load), G=state.rows, h=np.array(load.g))
        return qpsolvers.Problem(state.P, state.q(load), lb=np.zeros(len(load.p)))

    def solve(self, ready: Any, load: Load, tolerance: float) -> Answer:
        options = TOLERANCE.get(self.name)
        details: dict[str, Any] = {} if options else {"tolerance": "not taken"}
        settings = options(tolerance) if options else {}
        try:
            solution = qpsolvers.solve_problem(ready, self.name, **settings)
        except QPError as error:
            return Answer("failed", None, details={**details, "message": str(error)})
        primal = ready.G is not None
        lam, x = (solution.z, solution.x) if primal else (solution.x, None)
        if lam is None or lam.size == 0:
            return Answer("failed", None, details=details)
        iterations = solution.extras.get("iterations", solution.extras.get("iter"))
        if isinstance(iterations, np.ndarray):  # quadprog: constraints added, constraints dropped
            iterations = int(iterations.sum())
        return answer(
            "solved" if solution.found else "failed",
            tolerance,
            lam,
            x,
            iterations=iterations,
            reported_s=solution.solve_time,
            details=details,
        )
