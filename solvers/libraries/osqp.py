"""OSQP: the alternating direction method of multipliers, https://osqp.org.

Stops when ‖Aᵀx − s‖∞ and ‖Kx − f + Aλ‖∞ (primal and sparse form), or ‖λ − s‖∞ and
‖Qλ − p − w‖∞ (dual form), and the duality gap are below the tolerance. ρ is adapted every 50 iterations and
never by the clock, so the iteration count does not depend on the machine.
"""

from typing import Any, ClassVar

import numpy as np
import osqp

from solvers.adapter import Converted, Library, rows_for_bounds, upper_triangle
from solvers.base import Answer, LoadCase, Problem, Status, WarmStart

STATUS: dict[int, Status] = {
    int(osqp.SolverStatus.OSQP_SOLVED): "solved",
    int(osqp.SolverStatus.OSQP_SOLVED_INACCURATE): "inaccurate",
    int(osqp.SolverStatus.OSQP_MAX_ITER_REACHED): "iteration_limit",
}
NO_TIME_LIMIT = 1e10  # s, OSQP's default
RHO_BY_ITERATIONS = 1  # OSQP_ADAPTIVE_RHO_UPDATE_ITERATIONS
POLISH = {0: "not tried", 1: "accepted", 2: "nothing active", -1: "rejected", -2: "failed"}


class Osqp(Library):
    """polishing : solve again on the estimated active set. OSQP may accept a result outside the tolerance and
    still report solved (its issue 790); if its own residuals exceed the tolerance, the status is inaccurate.
    settings : OSQP's own, as scaling = 0.
    """

    choices: ClassVar[dict[str, tuple[bool, ...]]] = {"polishing": (False, True)}

    def defaults(self) -> Any:
        interface = osqp.OSQP().ext
        settings = interface.OSQPSettings()
        interface.osqp_set_default_settings(settings)
        return settings

    def convert(self, problem: Problem) -> Converted:
        return Converted(problem, upper_triangle(problem.blocks), rows_for_bounds(problem, 1.0))

    def setup(self, state: Converted, load: LoadCase, tolerance: float) -> Any:
        q, h = state.vectors(load)
        free = np.full(state.G.shape[0], np.inf)
        bounds = (np.zeros_like(free), free) if h is None else (-free, h)
        settings = {
            "eps_abs": tolerance,
            "eps_rel": 0.0,
            "check_dualgap": True,
            "max_iter": self.most(1_000_000),
            "time_limit": min(self.time_limit_s, NO_TIME_LIMIT),
            "adaptive_rho": RHO_BY_ITERATIONS,
            "adaptive_rho_interval": 50,
            "verbose": self.prints,
        }
        library = osqp.OSQP()
        library.setup(state.P, q, state.G, *bounds, **settings | self.selected | self.settings)
        return state, library

    def update(self, state: Converted, ready: Any, load: LoadCase, tolerance: float, start: WarmStart) -> Any:
        """OSQP.update and warm_start; the factors and the last ρ are kept."""
        _, library = ready
        library.update_settings(eps_abs=self.settings.get("eps_abs", tolerance))
        (q, h), (z, multipliers) = state.vectors(load), state.start(start)
        library.update(q=q, **({} if h is None else {"u": h}))
        # OSQP's multipliers of lower bounds are negative.
        library.warm_start(x=z, y=-np.maximum(multipliers, 0.0) if state.problem.bounded else multipliers)
        return ready

    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
        state, library = ready
        result = library.solve(raise_error=False)
        info = result.info
        status = STATUS.get(info.status_val, "failed")
        worst = max(info.prim_res, info.dual_res, abs(info.duality_gap))
        if status == "solved" and worst > tolerance:
            status = "inaccurate"
        details = {"status": info.status, "polish": POLISH[info.status_polish]}
        report = Answer(status, iterations=info.iter, reported_s=info.run_time, details=details)
        return state.answer(report, result.x, result.y, tolerance)
