"""Modified proportioning with reduced gradient projections for min ½λᵀQλ − pᵀλ, λ ≥ 0.

Z. Dostál and J. Schöberl, Comput. Optim. Appl. 30:23–43, 2005: conjugate gradients on the face λ > 0, as long
as the other contacts' share of the gradient is small; projected gradient steps and proportioning change the
face (solvers/algorithms/proportioning.py). The only operation with Q is a product.

With a banded M ≈ Q⁻¹, the face is preconditioned, and gradients are projected in the norm of M⁻¹. To
precondition the face alone is not enough: Q is a compliance, so a gradient step of length 1/λmax(Q) moves
smooth fields only, and the face changes contact by contact.
"""

from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Vector
from problems.forms.banded_inverse import BandedInverse, Windows, banded_inverse
from solvers.algorithms.contact_sets import OpenFactor
from solvers.algorithms.proportioning import Band, Diagonal, Face, Proportioning, step_length
from solvers.base import Answer, LoadCase, Problem, Status, failed
from solvers.kkt import dual_answer, kkt_residual, with_x
from solvers.method import Method, State, first_point
from solvers.options import one_of, require

PRECONDITIONERS = ("band", "face", "none")
MAX_PRODUCTS = 100_000  # with Q
FEW = 3000  # contacts of a sparse K for which Q⁻¹ is made


@dataclass(frozen=True, kw_only=True)
class _State(State):
    """diagonal : of Q, approximately. alpha : ᾱ of the metric."""

    diagonal: Vector
    alpha: float
    M: BandedInverse


@dataclass(kw_only=True, frozen=True, eq=False)
class Mprgp(Method):
    """MPRGP with Γ = 1, from λ = 0 or a warm start.

    Stops when the errors, −y and |y| where λ > 0, are at most max(tolerance/10, `kkt.rounding_bound`) mm with
    a recomputed y = Qλ − p; or when one recomputation has not halved the largest of them, if that is below
    the tolerance, or five have not. "solved" if they are then at most max(tolerance, `kkt.rounding_bound`)
    mm, else "inaccurate". Iterations are steps, inner iterations contact sets tried with M; details count the
    products with Q per load case. In the sparse form the status is that of the refined x (solvers/kkt.py).

    Options
    -------
    preconditioner : "band", M on the face and in the projections; "face", M on the face and diag(Q) in the
        projections; "none", diag(Q) in both.
    """

    forms = ("dual", "sparse")

    preconditioner: str = "band"

    def __post_init__(self) -> None:
        require("mprgp", vars(self), preconditioner=one_of(self.preconditioner, PRECONDITIONERS))

    def state(self, problem: Problem) -> _State | Answer:
        """The state with M and ᾱ, which takes 30 products; a failed answer if there is no M.

        M is Q⁻¹ for a dense Q without decay, and for few contacts of a sparse K.
        """
        near = problem.prepared.approximate_inverse
        diagonal, M, m = near.diagonal, near.M, len(near.diagonal)
        if M is None:
            if not problem.prepared.assembly.K.dense and m > FEW:
                return failed("no M ≈ Q⁻¹: K has no band, or its contacts lie all over an area")
            Q = problem.prepared.Q
            diagonal, M = np.diag(Q).copy(), banded_inverse(Q, Windows(np.arange(m), m))
        banded = self.preconditioner == "band"
        alpha = 1.0 if banded else step_length(problem.prepared.compliance, diagonal)
        return _State(problem=problem, diagonal=diagonal, alpha=alpha, M=M)

    def _metric(self, ready: _State) -> Diagonal:
        if self.preconditioner == "none":
            return Diagonal(ready.diagonal, ready.alpha)
        kind = Band if self.preconditioner == "band" else Face
        return kind(ready.diagonal, ready.alpha, OpenFactor(ready.M))

    def solved(self, ready: _State, load: LoadCase, tolerance: float) -> Answer:
        prepared, metric = ready.problem.prepared, self._metric(ready)
        (dual,) = prepared.with_p([load])

        def gaps(lam: Vector) -> Vector:
            return prepared.gaps(lam[:, None], [dual])[:, 0]

        first = first_point(ready.dual_start, dual)
        case = Proportioning(prepared.compliance, dual.p, ready.diagonal, metric, gaps, *first)
        most = self.most(MAX_PRODUCTS)
        enough = case.solve(tolerance, most, self.log)
        residual = kkt_residual(case.lam, case.y)
        status: Status = "solved" if case.is_optimal(tolerance) else "inaccurate"
        details = {"products": case.products, "steps": case.steps}
        counts, limit = (sum(case.steps.values()), metric.sets), "" if enough else f"{most} products"
        answer = dual_answer(status, case.lam, residual, details, counts, limit)
        return with_x(ready.problem, [answer], [load], tolerance)[0]
