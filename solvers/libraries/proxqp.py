"""ProxQP of ProxSuite: a proximal augmented Lagrangian method, https://github.com/Simple-Robotics/proxsuite.

Dense backend. Stops when the unscaled ∞-norms of both residuals and the duality gap are below the
tolerance. The dual form uses its box constraints, so no rows are formed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from proxsuite import proxqp

from solvers.base import Answer, Load, Near, Problem, Solver, Status

from .adapter import Converted, answer, blocks_of, choice, dense

BACKENDS = {
    "automatic": proxqp.dense.DenseBackend.Automatic,
    "primal_dual_ldlt": proxqp.dense.DenseBackend.PrimalDualLDLT,
    "primal_ldlt": proxqp.dense.DenseBackend.PrimalLDLT,
}
STATUS: dict[Any, Status] = {
    proxqp.QPSolverOutput.PROXQP_SOLVED: "solved",
    proxqp.QPSolverOutput.PROXQP_SOLVED_CLOSEST_PRIMAL_FEASIBLE: "inaccurate",
    proxqp.QPSolverOutput.PROXQP_MAX_ITER_REACHED: "iteration_limit",
}
INFINITY = 1e20  # what ProxQP takes for no bound


class ProxQp(Solver):
    """backend : which matrix it factors; "automatic" decides by the sizes."""

    def __init__(self, *, backend: str = "automatic") -> None:
        choice("proxqp", "backend", backend, tuple(BACKENDS))
        self.backend = backend

    def convert(self, problem: Problem) -> Converted:
        rows = problem.assembly.A.T.toarray() if problem.form == "primal" else None
        return Converted(problem.form, dense(blocks_of(problem)), rows)

    def setup(self, state: Converted, load: Load, tolerance: float) -> Any:
        m = len(load.g)
        backend = BACKENDS[self.backend]
        if state.form == "primal":
            library = proxqp.dense.QP(len(load.f), 0, m, False, dense_backend=backend)
        else:
            library = proxqp.dense.QP(m, 0, 0, True, dense_backend=backend)
        settings = library.settings
        settings.eps_abs = settings.eps_duality_gap_abs = tolerance
        settings.eps_rel = settings.eps_duality_gap_rel = 0.0
        settings.check_duality_gap = True
        settings.max_iter = 100_000
        settings.max_iter_in = 100_000
        settings.compute_timings = True
        if state.form == "primal":
            lower = np.full(m, -INFINITY)
            library.init(H=state.P, g=state.q(load), C=state.rows, l=lower, u=load.g)
        else:
            upper = np.full(m, INFINITY)
            library.init(H=state.P, g=state.q(load), l_box=np.zeros(m), u_box=upper)
        return state.form, library, ()

    def update(self, state: Converted, ready: Any, load: Load, tolerance: float, near: Near) -> Any:
        """QP.update, with the preconditioner kept, and a warm start.

        It cannot be given the multipliers of box constraints, so that the dual form starts from the case
        before, whichever is near.
        """
        form, library, start = ready
        if form == "primal":
            library.settings.initial_guess = proxqp.InitialGuess.WARM_START
            library.update(g=state.q(load), u=load.g)
            start = near.x, np.zeros(0), near.lam
        else:
            library.settings.initial_guess = proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
            library.update(g=state.q(load))
        return form, library, start

    def solve(self, ready: Any, load: Load, tolerance: float) -> Answer:
        form, library, start = ready
        library.solve(*start)
        result, info = library.results, library.results.info
        lam, x = (result.z, result.x) if form == "primal" else (result.x, None)
        return answer(
            STATUS.get(info.status, "failed"),
            tolerance,
            lam,
            x,
            iterations=info.iter_ext,
            inner_iterations=info.iter,
            reported_s=info.run_time * 1e-6,  # µs
            details={"status": info.status.name},
        )
