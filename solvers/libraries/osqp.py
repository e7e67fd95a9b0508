"""OSQP: the alternating direction method of multipliers, https://osqp.org.

Stops when ‖Aᵀx − s‖∞ and ‖Kx − f + Aλ‖∞ (primal form), or ‖λ − s‖∞ and ‖Qλ − p − w‖∞ (dual form), and
the duality gap are below the tolerance. ρ is adapted every 50 iterations and never by the clock, so the
iteration count does not depend on the machine.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import osqp
import scipy.sparse as sp

from solvers.base import Answer, Load, Near, Problem, Solver, Status

from .adapter import Converted, answer, blocks_of, choice, upper_triangle

STATUS: dict[int, Status] = {
    int(osqp.SolverStatus.OSQP_SOLVED): "solved",
    int(osqp.SolverStatus.OSQP_SOLVED_INACCURATE): "inaccurate",
    int(osqp.SolverStatus.OSQP_MAX_ITER_REACHED): "iteration_limit",
}
RHO_BY_ITERATIONS = 1  # OSQP_ADAPTIVE_RHO_UPDATE_ITERATIONS
POLISH = {0: "not tried", 1: "accepted", 2: "nothing active", -1: "rejected", -2: "failed"}


class Osqp(Solver):
    """polishing : solve once more on the guessed active set. OSQP may accept the outcome outside the
    tolerance and still say solved (its issue 790): by its own residuals that is inaccurate, and so called.
    """

    def __init__(self, *, polishing: bool = False) -> None:
        choice("osqp", "polishing", polishing, (False, True))
        self.polishing = polishing

    def convert(self, problem: Problem) -> Converted:
        rows = problem.assembly.A.T if problem.form == "primal" else sp.eye(problem.assembly.m)
        return Converted(problem.form, upper_triangle(blocks_of(problem)), sp.csc_matrix(rows))

    def setup(self, state: Converted, load: Load, tolerance: float) -> Any:
        m = len(load.g)
        free = np.full(m, np.inf)
        bounds = (-free, load.g) if state.form == "primal" else (np.zeros(m), free)
        library = osqp.OSQP()
        library.setup(
            state.P,
            state.q(load),
            state.rows,
            *bounds,
            eps_abs=tolerance,
            eps_rel=0.0,
            check_dualgap=True,
            max_iter=1_000_000,
            adaptive_rho=RHO_BY_ITERATIONS,
            adaptive_rho_interval=50,
            polishing=self.polishing,
            verbose=False,
        )
        return state.form, library

    def update(self, state: Converted, ready: Any, load: Load, tolerance: float, near: Near) -> Any:
        """OSQP.update and warm_start; the factors and the last ρ are kept."""
        form, library = ready
        if form == "primal":
            library.update(q=state.q(load), u=load.g)
            library.warm_start(x=near.x, y=near.lam)
        else:
            library.update(q=state.q(load))
            library.warm_start(x=near.lam, y=-np.maximum(near.gap, 0.0))
        return ready

    def solve(self, ready: Any, load: Load, tolerance: float) -> Answer:
        form, library = ready
        result = library.solve(raise_error=False)
        info = result.info
        status = STATUS.get(info.status_val, "failed")
        worst = max(info.prim_res, info.dual_res, abs(info.duality_gap))
        if status == "solved" and worst > tolerance:
            status = "inaccurate"
        lam, x = (result.y, result.x) if form == "primal" else (result.x, None)
        return answer(
            status,
            tolerance,
            lam,
            x,
            iterations=info.iter,
            reported_s=info.run_time,
            details={"status": info.status, "polish": POLISH[info.status_polish]},
        )
