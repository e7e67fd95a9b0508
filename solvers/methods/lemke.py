"""Lemke's method for the linear complementarity problem y = Qλ − p, λ ≥ 0, y ≥ 0, λᵀy = 0.

C. E. Lemke, Management Sci. 11:681–689, 1965. The artificial variable t with a covering vector d > 0,
y = Qλ − p + td, starts at max p_i/d_i, where λ = 0 is a solution, and for positive definite Q falls at every
pivot: the pivots follow the solutions for p − td down to t = 0 (solvers/active_set/parametric_path.py). The
d_i are random between 1 and 2, so that contacts with equal p_i do not reach zero at the same t. In a series,
d is the change of p from the load case whose answer is the start, and t goes from 1 to 0.
"""

from dataclasses import dataclass, replace

import numpy as np

from problems.forms.assembly import Matrix, Vector
from solvers.active_set.parametric_path import ParametricPath
from solvers.active_set.principal_sets import solve_from
from solvers.base import Answer, LoadCase, WarmStart
from solvers.kkt import judged, kkt_status
from solvers.method import Method, State
from solvers.settings import require


@dataclass(kw_only=True, frozen=True, eq=False)
class Lemke(Method):
    """Lemke's pivots, with a factor of Q_CC that grows and shrinks.

    Ends at t = 0 with λ_C refined: "solved" if max(max(−y), max_{λ>0} |y|) ≤ max(tolerance,
    4ε max(|p| + |Q|λ)) mm. Where rounding has left a wrong sign, block principal pivoting continues from its
    set (details: finishing_sets), and its status is the answer's. Iterations are pivots; details count the
    products with Q unless it continues.

    Options
    -------
    max_pivots : limit on the pivots, in units of m.
    """

    max_pivots: float = 10.0

    def __post_init__(self) -> None:
        require("lemke", vars(self), max_pivots=(self.max_pivots > 0, "must be positive"))

    def solved(self, ready: State, load: LoadCase, tolerance: float) -> Answer:
        Q, p = ready.Q, load.p
        path = _path(Q, p, ready.start)
        arrived = path.follow(int(self.max_pivots * len(p)) + 10)
        if not arrived:
            path.t = 0.0
            path.refresh()
        lam = np.maximum(path.lam, 0.0)
        y = path.y if (path.lam >= 0).all() else Q @ lam - p
        status, residual = kkt_status(Q, p, lam, y, tolerance)
        if arrived and (status != "solved" or (path.lam < 0).any()):
            closed = np.zeros(len(p), dtype=bool)
            closed[path.C] = True
            answer = solve_from(closed, Q, p, tolerance)
            details = {**answer.details, "finishing_sets": answer.iterations}
            return replace(answer, iterations=path.pivots, details=details)
        limit = f"max_pivots = {self.max_pivots:g}"
        return judged(status, lam, residual, {"products": path.products}, limit, iterations=path.pivots)


def _path(Q: Matrix, p: Vector, start: WarmStart | None) -> ParametricPath:
    if start is not None:
        return ParametricPath(Q, p, p - start.load.p, 1.0, np.flatnonzero(start.lam > 0))
    d = np.random.default_rng(0).uniform(1.0, 2.0, len(p))
    return ParametricPath(Q, p, d, max(float((p / d).max(initial=0.0)), 0.0), np.empty(0, dtype=np.intp))
