"""Clarabel: a primal–dual interior-point method on a homogeneous embedding, https://clarabel.org.

Stops when both residuals, as 2-norms divided by max(1, norms of data and iterates), and the absolute
duality gap are below the tolerance; the relative gap test is off. `AlmostSolved` is not solved.

The dual form's Q has eigenvalues down to 1e-5 mm/N and costs of 1e8 N·mm, whose last bit is 1e-8. Its
equilibration and its regularisation of 1e-8 then cost digits (at n = 4386 it gives up, or ends as
`AlmostSolved` some 1e-5 mm off): without the first, and with 1e-12 for the second, it ends as `Solved`
within 1e-10 mm there on three plates; on smaller ones the worst of seven was 8e-8 mm. These two
settings were chosen on such plates. The primal form keeps the defaults.
"""

from __future__ import annotations

from typing import Any

import clarabel
import numpy as np
import scipy.sparse as sp

from solvers.base import Answer, Load, Near, Problem, Solver, Status

from .adapter import Converted, answer, blocks_of, choice, upper_triangle

STATUS: dict[str, Status] = {
    "Solved": "solved",
    "AlmostSolved": "inaccurate",
    "MaxIterations": "iteration_limit",
}


class Clarabel(Solver):
    """direct_solve_method : "faer" factors the dense blocks by supernodes, "qdldl" entry by entry;
    "auto" would choose qdldl for them.
    """

    def __init__(self, *, direct_solve_method: str = "faer") -> None:
        choice("clarabel", "direct_solve_method", direct_solve_method, ("faer", "qdldl", "auto"))
        self.direct_solve_method = direct_solve_method

    def convert(self, problem: Problem) -> Converted:
        rows = problem.assembly.A.T if problem.form == "primal" else -sp.eye(problem.assembly.m)
        return Converted(problem.form, upper_triangle(blocks_of(problem)), sp.csc_matrix(rows))

    def setup(self, state: Converted, load: Load, tolerance: float) -> Any:
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_iter = 500
        settings.direct_solve_method = self.direct_solve_method
        settings.tol_feas = tolerance
        settings.tol_gap_abs = tolerance
        settings.tol_gap_rel = 0.0
        if state.form == "dual":
            settings.equilibrate_enable = False
            settings.static_regularization_constant = 1e-12
        bounds = load.g if state.form == "primal" else np.zeros_like(load.p)
        cones = [clarabel.NonnegativeConeT(len(bounds))]
        library = clarabel.DefaultSolver(state.P, state.q(load), state.rows, bounds, cones, settings)
        return state.form, library

    def update(self, state: Converted, ready: Any, load: Load, tolerance: float, near: Near) -> Any:
        """Clarabel's update of the vectors, with the equilibration kept; it has no warm start."""
        form, library = ready
        if form == "primal":
            library.update(q=state.q(load), b=load.g)
        else:
            library.update(q=state.q(load))
        return ready

    def solve(self, ready: Any, load: Load, tolerance: float) -> Answer:
        form, library = ready
        result = library.solve()
        lam, x = (result.z, np.array(result.x)) if form == "primal" else (result.x, None)
        return answer(
            STATUS.get(str(result.status), "failed"),
            tolerance,
            np.array(lam),
            x,
            iterations=result.iterations,
            reported_s=result.solve_time,  # includes its set-up
            details={"status": str(result.status)},
        )
