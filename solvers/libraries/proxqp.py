"""ProxQP of ProxSuite: a proximal augmented Lagrangian method, https://github.com/Simple-Robotics/proxsuite.

The sparse backend in the sparse form, else the dense one. Stops when the unscaled ∞-norms of both residuals
and the duality gap are below the tolerance. The dual form uses its box constraints, so no rows are formed.
"""

from typing import Any, ClassVar

import numpy as np
import scipy.sparse as sp
from proxsuite import proxqp

from solvers.adapter import Converted, Library, converted, is_sparse, set_absolute
from solvers.base import DENSE_FORMS, Answer, LoadCase, Problem, Status, WarmStart
from solvers.options import apply

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


class ProxQp(Library):
    """backend : which matrix the dense backend factors; "automatic" decides by the sizes. Only "automatic"
    takes the sparse form. settings : ProxQP's own, as default_rho = 1e-7.
    """

    distribution = "proxsuite"

    choices: ClassVar[dict[str, tuple[str, ...]]] = {"backend": tuple(BACKENDS)}

    def __init__(self, **options: object) -> None:
        super().__init__(**options)
        if self.selected["backend"] != "automatic":
            self.forms = DENSE_FORMS

    def defaults(self) -> Any:
        return proxqp.dense.QP(1, 0, 0).settings

    def convert(self, problem: Problem) -> Converted:
        return converted(problem, is_sparse(problem.blocks))

    def setup(self, state: Converted, load: LoadCase, tolerance: float) -> Any:
        q, h = state.vectors(load)
        rows = 0 if h is None else len(h)
        if sp.issparse(state.P):
            library = proxqp.sparse.QP(len(q), 0, rows)
        else:
            backend = BACKENDS[self.selected["backend"]]
            library = proxqp.dense.QP(len(q), 0, rows, state.problem.bounded, dense_backend=backend)
        settings = library.settings
        set_absolute(settings, tolerance, load)
        settings.max_iter, settings.max_iter_in = self.most(100_000), 100_000
        settings.verbose = self.prints
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
        set_absolute(library.settings, tolerance, load)
        apply(library.settings, self.settings)
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
        report = Answer(
            STATUS.get(info.status, "failed"),
            iterations=info.iter_ext,
            inner_iterations=info.iter,
            reported_s=info.run_time * 1e-6,  # µs
            details={"status": info.status.name},
        )
        return state.answer(report, result.x, result.z, tolerance)
