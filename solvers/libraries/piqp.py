"""PIQP: a proximal interior-point method, https://predict-epfl.github.io/piqp.

Stops when the unscaled ∞-norms of both residuals and the duality gap are below the tolerance; its
relative tests, alternatives to these, are off. The dual form passes λ ≥ 0 as bounds, not as rows. In the
sparse form, the rows are eliminated from the KKT system, so what is factored has the pattern of K̂ + BBᵀ.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import piqp
import scipy.sparse as sp

from solvers.adapter import Converted, choice, dense, gap_tolerance, is_sparse, upper_triangle
from solvers.base import DENSE_FORMS, FORMS, Answer, LoadCase, Problem, Solver, Status, WarmStart
from solvers.settings import apply, chosen

STATUS: dict[Any, Status] = {
    piqp.PIQP_SOLVED: "solved",
    piqp.PIQP_MAX_ITER_REACHED: "iteration_limit",
}


class Piqp(Solver):
    """backend : "dense" or "sparse" Cholesky; None: as the blocks of P are. Where they are dense, dense is
    several times faster in both forms (measured from n = 594 to 4386); sparse takes less memory in the primal
    form. settings : PIQP's own, as rho_init = 1e-8.
    """

    def __init__(self, *, backend: str | None = None, **settings: object) -> None:
        choice("piqp", "backend", backend, ("dense", "sparse", None))
        self.backend = backend
        self.settings = chosen("piqp", settings, piqp.DenseSolver().settings)
        self.forms = DENSE_FORMS if backend == "dense" else FORMS  # type: ignore[misc]  # of this solver alone

    def convert(self, problem: Problem) -> Converted:
        G = problem.G
        if self.backend == "sparse" or is_sparse(problem.blocks):
            rows = None if G is None else sp.csc_matrix(G)
            return Converted(problem, upper_triangle(problem.blocks), rows)
        return Converted(problem, dense(problem.blocks), None if G is None else G.toarray(order="F"))

    def setup(self, state: Converted, load: LoadCase, tolerance: float) -> Any:
        library = piqp.SparseSolver() if sp.issparse(state.P) else piqp.DenseSolver()
        settings = library.settings
        settings.eps_abs = tolerance
        settings.eps_duality_gap_abs = gap_tolerance(tolerance, load)
        settings.eps_rel = settings.eps_duality_gap_rel = 0.0
        settings.check_duality_gap = True
        settings.max_iter = 500
        settings.compute_timings = True
        if is_sparse(state.problem.blocks):
            settings.kkt_solver = piqp.sparse_ldlt_ineq_cond
        apply(settings, self.settings)
        q, h = state.vectors(load)
        limits = {"x_l": np.zeros_like(q)} if h is None else {"G": state.G, "h_u": h}
        library.setup(state.P, q, **limits)
        return state, library

    def update(self, state: Converted, ready: Any, load: LoadCase, tolerance: float, start: WarmStart) -> Any:
        """PIQP's update of the vectors, with the preconditioner kept; it has no warm start."""
        q, h = state.vectors(load)
        ready[1].settings.eps_duality_gap_abs = gap_tolerance(tolerance, load)
        ready[1].update(c=q, **({} if h is None else {"h_u": h}))
        return ready

    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
        state, library = ready
        status = library.solve()
        result, info = library.result, library.result.info
        return state.answer(
            STATUS.get(status, "failed"),
            tolerance,
            result.x,
            result.z_u,
            iterations=info.iter,
            reported_s=info.run_time,
            details={"status": status.name},
        )
