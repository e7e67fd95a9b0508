"""CVXPY, a modelling language for OSQP, Clarabel or QOCO, https://www.cvxpy.org: the cost of modelling.

The set-up is CVXPY's compilation of the model, the solve is the solver with CVXPY's own conversion of its
answer. The model has P, G as constants and q, h as parameters, so that a further load case is not compiled
again. The tolerance is passed on as OSQP's `eps_abs`, QOCO's `abstol` or Clarabel's three, with relative ones
0; all else is left at CVXPY's defaults, as a user would have it. OSQP's polishing, one of them, may end
outside the tolerance: the status is then inaccurate.
"""

from dataclasses import dataclass
from typing import Any

import cvxpy as cp
import scipy.sparse as sp

from solvers.adapter import Converted, gap_tolerance
from solvers.base import FORMS, Answer, LoadCase, Problem, Solver, Status, WarmStart
from solvers.options import one_of, require

STATUS: dict[str, Status] = {
    cp.OPTIMAL: "solved",
    cp.OPTIMAL_INACCURATE: "inaccurate",
    cp.USER_LIMIT: "iteration_limit",
}
#: CVXPY's own choice for a quadratic program, and those that may be asked for.
SOLVERS = (None, cp.OSQP, cp.CLARABEL, cp.QOCO)


@dataclass
class Model:
    """A compiled model. data, chain, inverse : CVXPY's, for the present values of q and h."""

    problem: cp.Problem
    z: cp.Variable
    q: cp.Parameter
    h: cp.Parameter | None
    data: Any = None
    chain: Any = None
    inverse: Any = None


class Cvxpy(Solver):
    """via : "OSQP", "CLARABEL", "QOCO", or None for CVXPY's own choice, which is OSQP."""

    forms = FORMS

    def __init__(self, *, via: str | None = None) -> None:
        require("cvxpy", {"via": via}, via=one_of(via, SOLVERS))
        self.via = via

    def convert(self, problem: Problem) -> Converted:
        G = problem.G
        P = sp.block_diag(problem.blocks, format="csc") if len(problem.blocks) > 1 else problem.blocks[0]
        return Converted(problem, P, None if G is None else sp.csc_matrix(G))

    def setup(self, state: Converted, load: LoadCase, tolerance: float) -> Any:
        q, h = state.vectors(load)
        z, linear = cp.Variable(len(q)), cp.Parameter(len(q))
        right = None if h is None else cp.Parameter(len(h))
        rows = z >= 0 if right is None else state.G @ z <= right
        # psd_wrap: CVXPY's own test for convexity would cost an eigenvalue
        objective = cp.quad_form(z, cp.psd_wrap(state.P)) / 2 + linear @ z
        model = Model(cp.Problem(cp.Minimize(objective), [rows]), z, linear, right)
        return self._compiled(state, model, load)

    def update(self, state: Converted, ready: Any, load: LoadCase, tolerance: float, start: WarmStart) -> Any:
        """The parameters' new values; CVXPY keeps what it has compiled."""
        return self._compiled(state, ready[1], load)

    def _compiled(self, state: Converted, model: Model, load: LoadCase) -> tuple[Converted, Model]:
        q, h = state.vectors(load)
        model.q.value = q
        if model.h is not None:
            model.h.value = h
        model.data, model.chain, model.inverse = model.problem.get_problem_data(self.via, solver_opts={})
        return state, model

    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
        state, model = ready
        gap = gap_tolerance(tolerance, load)
        name = model.chain.solver.name()
        settings = {
            cp.OSQP: {"eps_abs": tolerance, "eps_rel": 0.0, "max_iter": self.most(1_000_000)},
            cp.CLARABEL: {
                "tol_feas": tolerance,
                "tol_gap_abs": gap,
                "tol_gap_rel": 0.0,
                "max_iter": self.most(500),
            },
            cp.QOCO: {"abstol": tolerance, "reltol": 0.0, "max_iters": self.most(500)},
        }[name]
        raw = model.chain.solve_via_data(model.problem, model.data, verbose=self.prints, solver_opts=settings)
        try:
            model.problem.unpack_results(raw, model.chain, model.inverse)
        except cp.SolverError as error:
            return Answer("failed", details={"solver": name, "message": str(error)})
        (rows,) = model.problem.constraints
        if model.z.value is None:
            return Answer("failed", details={"solver": name, "status": model.problem.status})
        status = STATUS.get(model.problem.status, "failed")
        if name == cp.OSQP and status == "solved" and not _within(model.problem, tolerance):
            status = "inaccurate"
        report = Answer(status, iterations=model.problem.solver_stats.num_iters, details={"solver": name})
        return state.answer(report, model.z.value, rows.dual_value, tolerance)


def _within(problem: cp.Problem, tolerance: float) -> bool:
    """Whether the residuals and the duality gap of OSQP's own report are within the tolerance."""
    info = problem.solver_stats.extra_stats.info
    return bool(max(info.prim_res, info.dual_res, abs(info.duality_gap)) <= tolerance)
