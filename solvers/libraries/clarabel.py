"""Clarabel: a primal–dual interior-point method on a homogeneous embedding, https://clarabel.org.

Stops when both residuals, as 2-norms divided by max(1, norms of data and iterates), and the absolute
duality gap are below the tolerance; the relative gap test is off. `AlmostSolved` is not solved.

In the dual form, Q has eigenvalues down to 1e-5 mm/N, and the objective is about 1e8 N·mm with a rounding
error of 1e-8. At n = 4386, equilibration and a regularisation of 1e-8 then end in a failure or an error of
about 1e-5 mm; without the former and with 1e-12 for the latter, three such problems end within 1e-10 mm. The
sparse form, too, is faster with 1e-12; the primal form keeps the defaults (docs/libraries.md).
"""

from typing import Any, ClassVar

import clarabel
import numpy as np

from solvers.adapter import Converted, Library, gap_tolerance, is_sparse, rows_for_bounds, upper_triangle
from solvers.base import Answer, LoadCase, Problem, Status, WarmStart
from solvers.options import apply

STATUS: dict[str, Status] = {
    "Solved": "solved",
    "AlmostSolved": "inaccurate",
    "MaxIterations": "iteration_limit",
}


class Clarabel(Library):
    """direct_solve_method : "faer" factors the dense blocks by supernodes, "qdldl" entry by entry;
    "auto" would choose qdldl for them. settings : Clarabel's own, as equilibrate_enable = true.
    """

    choices: ClassVar[dict[str, tuple[str, ...]]] = {"direct_solve_method": ("faer", "qdldl", "auto")}

    def defaults(self) -> Any:
        return clarabel.DefaultSettings()

    def convert(self, problem: Problem) -> Converted:
        return Converted(problem, upper_triangle(problem.blocks), rows_for_bounds(problem, -1.0))

    def setup(self, state: Converted, load: LoadCase, tolerance: float) -> Any:
        q, h = state.vectors(load)
        h = np.zeros(state.G.shape[0]) if h is None else h
        cones = [clarabel.NonnegativeConeT(len(h))]
        settings = self._settings(state, load, tolerance)
        return state, clarabel.DefaultSolver(state.P, q, state.G, h, cones, settings)

    def _settings(self, state: Converted, load: LoadCase, tolerance: float) -> Any:
        settings = self.defaults()
        settings.verbose = self.prints
        settings.max_iter = self.most(500)
        settings.time_limit = self.time_limit_s
        settings.tol_feas = tolerance
        settings.tol_gap_abs = gap_tolerance(tolerance, load)
        settings.tol_gap_rel = 0.0
        settings.equilibrate_enable = not state.problem.bounded
        if state.problem.bounded or is_sparse(state.problem.blocks):
            settings.static_regularization_constant = 1e-12
        apply(settings, self.selected | self.settings)
        return settings

    def update(self, state: Converted, ready: Any, load: LoadCase, tolerance: float, start: WarmStart) -> Any:
        """Clarabel's update of the vectors, with the equilibration kept; it has no warm start."""
        q, h = state.vectors(load)
        settings = self._settings(state, load, tolerance)
        ready[1].update(q=q, settings=settings, **({} if h is None else {"b": h}))
        return ready

    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
        state, library = ready
        result = library.solve()
        report = Answer(
            STATUS.get(str(result.status), "failed"),
            iterations=result.iterations,
            reported_s=result.solve_time,  # includes its set-up
            details={"status": str(result.status)},
        )
        return state.answer(report, np.array(result.x), np.array(result.z), tolerance)
