"""ProxQP of ProxSuite: a proximal augmented Lagrangian method, https://github.com/Simple-Robotics/proxsuite.

The sparse backend in the sparse form, else the dense one. Stops when the unscaled ∞-norms of both residuals
and the duality gap are below the tolerance. The dual form uses its box constraints, so no rows are formed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from proxsuite import proxqp

from solvers.adapter import Converted, choice, dense, gap_tolerance, is_sparse, upper_triangle
from solvers.base import DENSE_FORMS, FORMS, Answer, LoadCase, Problem, Solver, Status, WarmStart
from solvers.settings import apply, chosen

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
INFINITY = 1e20  # ProxQP's value for no bound


class ProxQp(Solver):
    """backend : which matrix the dense backend factors; "automatic" decides by the sizes. Only "automatic"
    takes the sparse form. settings : ProxQP's own, as default_rho = 1e-7.
    """

    distribution = "proxsuite"

    def __init__(self, *, backend: str = "automatic", **settings: object) -> None:
        choice("proxqp", "backend", backend, tuple(BACKENDS))
        self.backend = backend
        self.settings = chosen("proxqp", settings, proxqp.dense.QP(1, 0, 0).settings)
        self.forms = FORMS if backend == "automatic" else DENSE_FORMS  # type: ignore[misc]  # of this solver alone

    def convert(self, problem: Problem) -> Converted:
        G = problem.G
        if is_sparse(problem.blocks):
            return Converted(problem, upper_triangle(problem.blocks), sp.csc_matrix(G))
        return Converted(problem, dense(problem.blocks), None if G is None else G.toarray())

    def setup(self, state: Converted, load: LoadCase, tolerance: float) -> Any:
        q, h = state.vectors(load)
        rows = 0 if h is None else len(h)
        if sp.issparse(state.P):
            library = proxqp.sparse.QP(len(q), 0, rows)
        else:
            backend = BACKENDS[self.backend]
            library = proxqp.dense.QP(len(q), 0, rows, state.problem.bounded, dense_backend=backend)
        settings = library.settings
        settings.eps_abs = tolerance
        settings.eps_duality_gap_abs = gap_tolerance(tolerance, load)
        settings.eps_rel = settings.eps_duality_gap_rel = 0.0
        settings.check_duality_gap = True
        settings.max_iter = 100_000
        settings.max_iter_in = 100_000
        settings.compute_timings = True
        apply(settings, self.settings)
        if h is None:
            library.init(H=state.P, g=q, l_box=np.zeros_like(q), u_box=np.full_like(q, INFINITY))
        else:
            library.init(H=state.P, g=q, C=state.G, l=np.full_like(h, -INFINITY), u=h)
        return state, library, ()

    def update(self, state: Converted, ready: Any, load: LoadCase, tolerance: float, start: WarmStart) -> Any:
        """QP.update, with the preconditioner kept, and a warm start.

        The multipliers of box constraints cannot be passed, so a problem with bounds starts from the case
        before, even if another is nearer.
        """
        _, library, _ = ready
        q, h = state.vectors(load)
        library.settings.eps_duality_gap_abs = gap_tolerance(tolerance, load)
        if h is None:
            library.settings.initial_guess = proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
            library.update(g=q)
            return state, library, ()
        library.settings.initial_guess = proxqp.InitialGuess.WARM_START
        library.update(g=q, u=h)
        z, multipliers = state.start(start)
        return state, library, (z, np.zeros(0), multipliers)

    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
        state, library, start = ready
        library.solve(*start)
        result, info = library.results, library.results.info
        return state.answer(
            STATUS.get(info.status, "failed"),
            tolerance,
            result.x,
            result.z,
            iterations=info.iter_ext,
            inner_iterations=info.iter,
            reported_s=info.run_time * 1e-6,  # µs
            details={"status": info.status.name},
        )
