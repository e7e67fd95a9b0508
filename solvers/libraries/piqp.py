"""PIQP: a proximal interior-point method, https://predict-epfl.github.io/piqp.

Stops when the unscaled ∞-norms of both residuals and the duality gap are below the tolerance; its
relative tests, alternatives to these, are off. The dual form passes λ ≥ 0 as bounds, not as rows.
"""

from typing import Any, ClassVar

import numpy as np
import piqp
import scipy.sparse as sp

from solvers.adapter import Converted, Library, converted, is_sparse, set_absolute
from solvers.base import DENSE_FORMS, Answer, LoadCase, Problem, Status, WarmStart
from solvers.options import apply

STATUS: dict[Any, Status] = {
    piqp.PIQP_SOLVED: "solved",
    piqp.PIQP_MAX_ITER_REACHED: "iteration_limit",
}


class Piqp(Library):
    """backend : "dense" or "sparse" Cholesky; None: as the blocks of P are. Where they are dense, dense is
    several times faster in both forms (measured from n = 594 to 4386); sparse takes less memory in the primal
    form. kkt_solver : of the sparse form; "sparse_ldlt_ineq_cond" eliminates the rows, so that what is
    factored has the pattern of K̂ + BBᵀ. settings : PIQP's own.
    """

    choices: ClassVar[dict[str, tuple[str | None, ...]]] = {
        "backend": (None, "dense", "sparse"),
        "kkt_solver": ("sparse_ldlt", "sparse_ldlt_ineq_cond"),
    }

    def __init__(self, **options: object) -> None:
        super().__init__(**options)
        if self.selected["backend"] == "dense":
            self.forms = DENSE_FORMS

    def defaults(self) -> Any:
        return piqp.DenseSolver().settings

    def convert(self, problem: Problem) -> Converted:
        return converted(problem, self.selected["backend"] == "sparse" or is_sparse(problem.blocks))

    def setup(self, state: Converted, load: LoadCase, tolerance: float) -> Any:
        library = piqp.SparseSolver() if sp.issparse(state.P) else piqp.DenseSolver()
        settings = library.settings
        set_absolute(settings, tolerance, load)
        settings.max_iter, settings.verbose = self.most(500), self.prints
        if is_sparse(state.problem.blocks):
            settings.kkt_solver = getattr(piqp, self.selected["kkt_solver"])
        apply(settings, self.settings)
        q, h = state.vectors(load)
        limits = {"x_l": np.zeros_like(q)} if h is None else {"G": state.G, "h_u": h}
        library.setup(state.P, q, **limits)
        return state, library

    def update(self, state: Converted, ready: Any, load: LoadCase, tolerance: float, start: WarmStart) -> Any:
        """PIQP's update of the vectors, with the preconditioner kept; it has no warm start."""
        q, h = state.vectors(load)
        set_absolute(ready[1].settings, tolerance, load)
        apply(ready[1].settings, self.settings)
        ready[1].update(c=q, **({} if h is None else {"h_u": h}))
        return ready

    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
        state, library = ready
        status = library.solve()
        result, info = library.result, library.result.info
        report = Answer(
            STATUS.get(status, "failed"),
            iterations=info.iter,
            reported_s=info.run_time,
            details={"status": status.name},
        )
        return state.answer(report, result.x, result.z_u, tolerance)
