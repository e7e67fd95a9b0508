"""PIQP: a proximal interior-point method, https://predict-epfl.github.io/piqp.

Stops when the unscaled ∞-norms of both residuals and the duality gap are below the tolerance; its
relative tests, either of which would do, are off. The dual form passes λ ≥ 0 as bounds, not as rows.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import piqp
import scipy.sparse as sp

from solvers.base import Answer, Load, Near, Problem, Solver, Status

from .adapter import Converted, answer, blocks_of, choice, dense, upper_triangle

STATUS: dict[Any, Status] = {
    piqp.PIQP_SOLVED: "solved",
    piqp.PIQP_MAX_ITER_REACHED: "iteration_limit",
}


class Piqp(Solver):
    """backend : "dense" or "sparse" Cholesky. K consists of dense blocks, so dense is several times
    faster in both forms (seen from n = 594 to 4386); sparse takes less memory in the primal form.
    """

    def __init__(self, *, backend: str = "dense") -> None:
        choice("piqp", "backend", backend, ("dense", "sparse"))
        self.backend = backend

    def convert(self, problem: Problem) -> Converted:
        blocks = blocks_of(problem)
        rows = problem.assembly.A.T if problem.form == "primal" else None
        if self.backend == "sparse":
            G = None if rows is None else sp.csc_matrix(rows)
            return Converted(problem.form, upper_triangle(blocks), G)
        return Converted(problem.form, dense(blocks), None if rows is None else rows.toarray(order="F"))

    def setup(self, state: Converted, load: Load, tolerance: float) -> Any:
        library = piqp.DenseSolver() if self.backend == "dense" else piqp.SparseSolver()
        settings = library.settings
        settings.eps_abs = settings.eps_duality_gap_abs = tolerance
        settings.eps_rel = settings.eps_duality_gap_rel = 0.0
        settings.check_duality_gap = True
        settings.max_iter = 500
        settings.compute_timings = True
        if state.form == "primal":
            library.setup(state.P, state.q(load), G=state.rows, h_u=load.g)
        else:
            library.setup(state.P, state.q(load), x_l=np.zeros(len(load.p)))
        return state.form, library

    def update(self, state: Converted, ready: Any, load: Load, tolerance: float, near: Near) -> Any:
        """PIQP's update of the vectors, with the preconditioner kept; it has no warm start."""
        form, library = ready
        if form == "primal":
            library.update(c=state.q(load), h_u=load.g)
        else:
            library.update(c=state.q(load))
        return ready

    def solve(self, ready: Any, load: Load, tolerance: float) -> Answer:
        form, library = ready
        status = library.solve()
        result, info = library.result, library.result.info
        lam, x = (result.z_u, result.x) if form == "primal" else (result.x, None)
        return answer(
            STATUS.get(status, "failed"),
            tolerance,
            lam,
            x,
            iterations=info.iter,
            reported_s=info.run_time,
            details={"status": status.name},
        )
