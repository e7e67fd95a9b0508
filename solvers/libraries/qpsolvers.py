"""All other solvers that qpsolvers finds, by their names there, https://github.com/qpsolvers/qpsolvers.

The matrices go through qpsolvers.Problem, λ comes back through Solution.z (primal form) or Solution.x
(dual form).

Those with a sparse interface take the sparse form. HiGHS does so for small models only: its active-set method
keeps a dense matrix of the order of the free unknowns.
"""

from collections.abc import Callable
from math import isfinite
from typing import Any

import numpy as np
import qpsolvers
import scipy.sparse as sp
from qpsolvers.exceptions import QPError

from solvers.adapter import Converted, dense, gap_tolerance, is_sparse, sorted_csc
from solvers.base import FORMS, Answer, LoadCase, Problem, Solver
from solvers.options import NO_OPTIONS, require

TINY = float(np.finfo(float).tiny)
#: Options that set the absolute tolerance, and that of the duality gap. Relative tolerances are 0, iteration
#: limits too large to matter. DAQP's default dual tolerance of 1e-12 is not loosened. HiGHS takes none
#: below 1e-10; by default it adds 1e-7 to the diagonal of P, which with eigenvalues of Q near 1e-5 changed x
#: by 1e-4 mm, and it gives up where its null space exceeds 4000. ECOS wants a relative tolerance above zero.
TOLERANCE: dict[str, Callable[[float, float], dict[str, Any]]] = {
    "cvxopt": lambda tol, gap: {"feastol": tol, "abstol": gap, "reltol": 0.0, "maxiters": 1_000},
    "daqp": lambda tol, gap: {"primal_tol": tol, "dual_tol": min(tol, 1e-12), "iter_limit": 1_000_000},
    "ecos": lambda tol, gap: {"feastol": tol, "abstol": gap, "reltol": TINY, "max_iters": 1_000},
    "highs": lambda tol, gap: {
        "primal_feasibility_tolerance": max(tol, 1e-10),
        "dual_feasibility_tolerance": max(tol, 1e-10),
        "qp_regularization_value": 0.0,
        "qp_nullspace_limit": 1_000_000,
    },
    "kvxopt": lambda tol, gap: {"feastol": tol, "abstol": gap, "reltol": 0.0, "maxiters": 1_000},
    "pyqpmad": lambda tol, gap: {"tolerance": tol, "max_iter": 1_000_000},
    "qpalm": lambda tol, gap: {"eps_abs": tol, "eps_rel": 0.0, "eps_rel_in": 0.0, "max_iter": 1_000_000},
    "qtqp": lambda tol, gap: {"tol_feas": tol, "tol_gap_abs": gap, "tol_gap_rel": 0.0, "max_iter": 1_000},
    "sip": lambda tol, gap: {"eps_abs": tol, "eps_rel": 0.0, "max_iterations": 1_000},
    "scs": lambda tol, gap: {"eps_abs": tol, "eps_rel": 0.0, "max_iters": 10_000_000},
}
#: The option of a limit in seconds, of those that give their last iterate then.
TIME_LIMIT = {"highs": "time_limit", "qpalm": "time_limit", "scs": "time_limit_secs"}

#: The settings that limit the iterations.
LIMITS = ("max_iter", "max_iters", "maxiters", "max_iterations")
#: The settings that print a log, where qpsolvers' `verbose` does more: checks, lines of each line search.
LOGS: dict[str, Any] = {"highs": {"log_to_console": True}, "sip": {"logging": {"print_logs": True}}}
#: The solvers that overwrite P with its factor.
OVERWRITE = ("pyqpmad",)

#: Distributions that have another name than the solver.
DISTRIBUTIONS = {"highs": "highspy", "sip": "sip-qp-python"}


class QpSolvers(Solver):
    """name : the solver's name in qpsolvers.available_solvers. settings : the solver's, passed on; solvers
    without a tolerance take none.
    """

    def __init__(self, name: str, **settings: object) -> None:
        if name not in TOLERANCE:
            require(name, settings, **dict.fromkeys(settings, (False, NO_OPTIONS)))
        self.name, self.settings = name, settings
        if name in qpsolvers.sparse_solvers:
            self.forms = FORMS

    def convert(self, problem: Problem) -> Converted:
        G = problem.G
        # Copies, because some of these solvers refuse read-only arrays.
        if self.name in qpsolvers.dense_solvers and not is_sparse(problem.blocks):
            P = np.array(dense(problem.blocks), order="C")
            return Converted(problem, P, None if G is None else G.toarray(order="C"))
        P = sp.block_diag([sp.csc_matrix(block) for block in problem.blocks], format="csc")
        return Converted(problem, sorted_csc(P), None if G is None else sorted_csc(G))

    def setup(self, state: Converted, load: LoadCase, tolerance: float) -> Any:
        q, h = state.vectors(load)
        limits = {"lb": np.zeros_like(q)} if h is None else {"G": state.G, "h": np.array(h)}
        P = state.P.copy() if self.name in OVERWRITE else state.P
        return state, qpsolvers.Problem(P, q, **limits)

    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
        state, problem = ready
        options = TOLERANCE.get(self.name)
        details: dict[str, Any] = {} if options else {"tolerance": "not taken"}
        settings = options(tolerance, gap_tolerance(tolerance, load)) if options else {}
        if self.name in TIME_LIMIT and isfinite(self.time_limit_s):
            settings[TIME_LIMIT[self.name]] = self.time_limit_s
        settings |= {key: self.most(settings[key]) for key in LIMITS if key in settings}
        if self.prints:
            settings |= LOGS.get(self.name, {"verbose": True})
        try:
            solution = qpsolvers.solve_problem(problem, self.name, **settings | self.settings)
        except QPError as error:
            return Answer("failed", details={**details, "message": str(error)})
        if solution.x is None or (not state.problem.bounded and (solution.z is None or not solution.z.size)):
            return Answer("failed", details=details)
        extras = solution.extras
        iterations = extras.get("iterations", extras.get("iter", getattr(extras.get("info"), "iter", None)))
        if isinstance(iterations, np.ndarray):  # quadprog: constraints added, constraints dropped
            iterations = int(iterations.sum())
        report = Answer(
            "solved" if solution.found else "failed",
            iterations=iterations,
            reported_s=solution.solve_time,
            details=details,
        )
        return state.answer(report, solution.x, solution.z, tolerance)
