"""Goldfarb–Idnani in the space of the constraints: u ≥ 0, s = s0 + Gu ≥ 0, uᵀs = 0, G positive definite.

Sources: Goldfarb and Idnani, Math. Programming 27:1–33, 1983 (the pivots); Powell, Math. Programming
Study 25:46–61, 1985 (the safeguards: violations within rounding do not count, dependence is tested,
and the point is recomputed from the original data before the method stops).
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as sla

from problems.forms.assembly import Indices, Matrix, Vector
from problems.stiffness.dense_block import product
from solvers.base import Status
from solvers.kkt import EPS

from .growing_factor import Border, GrowingFactor

#: u → (s, T): the slacks from the original data, and the magnitude of the terms of each.
Slacks = Callable[[Vector], tuple[Vector, Vector]]

CANDIDATES = 64  # violated constraints considered between two products with the whole of G
MAX_REFINEMENTS = 20
FAILED_REFINEMENTS = 2  # without progress, before the method gives up


@dataclass(frozen=True)
class GiResult:
    """u (m,), the active constraints C with the factor of G_CC, and the iteration counts."""

    status: Status
    u: Vector
    active: Indices
    factor: GrowingFactor
    pivots: int
    drops: int
    refinements: int
    cause: dict[str, str] = field(default_factory=dict)


def goldfarb_idnani(G: Matrix, slacks: Slacks, tolerance: float, max_pivots: int) -> GiResult:
    """Solve from u = 0.

    A slack is violated if s_k < −max(tolerance, 4ε T_k). Once none is after a refinement, and |s_C| is as
    small, pivoting continues down to the rounding level 4ε T_k as long as this makes progress: with nearly
    dependent constraints, a slack within the tolerance can hide a wrong set. "inaccurate" if refinement
    makes no more progress, "iteration_limit" at max_pivots.
    """
    state = _State(G, max_pivots)
    size = state.reset_base(slacks)  # Algorithm 1, step 2
    threshold, worst, attempts_left = tolerance, np.inf, FAILED_REFINEMENTS
    for refinements in range(1, MAX_REFINEMENTS + 1):
        state.pivot_until_feasible(np.maximum(threshold, 4 * EPS * size))  # steps 3 to 12
        if state.pivots >= max_pivots:
            return state.result("iteration_limit", refinements - 1)
        size = state.refine(slacks)
        violation = state.violation(np.maximum(tolerance, 4 * EPS * size))
        if violation == 0.0:
            threshold, violation = 0.0, state.violation(4 * EPS * size)
            if violation == 0.0 or violation >= worst:
                return state.result("solved", refinements)
        elif violation >= worst and attempts_left == 0:
            cause = f"rounding: a slack of {float(state.base.min()):.1e} remains after refinement"
            return state.result("inaccurate", refinements, cause)
        attempts_left -= violation >= worst
        worst = min(worst, violation)
    return state.result("inaccurate", MAX_REFINEMENTS, "refinement does not settle the active set")


class _State:
    """Multipliers u, the active set C in the order of the factor, and the counts.

    base : the slacks at u_base, from the original data. s = base + G(u − u_base), so that the rounding of G
    affects only the change since then.
    """

    def __init__(self, G: Matrix, max_pivots: int) -> None:
        self.G = G
        self.u = np.zeros(len(G))
        self.C: list[int] = []
        self.is_active = np.zeros(len(G), dtype=bool)
        self.factor = GrowingFactor(len(G))
        self.max_pivots = max_pivots
        self.pivots = self.drops = 0

    def result(self, status: Status, refinements: int, cause: str = "") -> GiResult:
        reason = {"cause": cause} if cause else {}
        active = np.array(self.C, dtype=np.intp)
        u = np.maximum(self.u, 0.0)
        return GiResult(status, u, active, self.factor, self.pivots, self.drops, refinements, reason)

    def reset_base(self, slacks: Slacks) -> Vector:
        """Compute the slacks at u from the original data; returns the magnitude of their terms."""
        self.base, size = slacks(self.u)
        self.u_base = self.u.copy()
        return size

    def refine(self, slacks: Slacks) -> Vector:
        """Powell: s from the original data, u_C −= G_CC⁻¹ s_C so that s_C = 0; drops negative multipliers."""
        while True:
            if self.C:
                s = slacks(self.u)[0][self.C]
                self.u[self.C] -= self.factor.solve(self.factor.solve_transposed(s))
            if not (self.u < 0).any():
                return self.reset_base(slacks)
            for position in reversed(range(len(self.C))):
                if self.u[self.C[position]] < 0:
                    k = self.C.pop(position)
                    self.u[k], self.is_active[k] = 0.0, False
                    self.factor.delete(position)
                    self.drops += 1

    def violation(self, limit: Vector) -> float:
        """The largest excess over the limit: of |s_C|, and of −s elsewhere."""
        excess = np.where(self.is_active, abs(self.base), -self.base) - limit
        return max(float(excess.max()), 0.0)

    def pivot_until_feasible(self, limit: Vector) -> None:
        """Add violated constraints, worst first, until s ≥ −limit."""
        while self.pivots < self.max_pivots:
            s = self.base + product(self.G, self.u - self.u_base)
            s[self.is_active] = 0.0
            violated = np.flatnonzero(s < -limit)
            if not violated.size:
                return
            worst = violated[np.argsort(s[violated])[:CANDIDATES]]
            self.pivot_among(worst, s[worst], limit[worst])

    def pivot_among(self, worst: Indices, s: Vector, limit: Vector) -> None:
        """Add the most violated of these constraints, with the slacks s, as long as there is one."""
        border = Border(self.G, np.array(self.C, dtype=np.intp), self.factor, worst)
        while self.pivots < self.max_pivots and len(border.removed) < len(worst):
            outside = ~self.is_active[worst]
            column = int(np.argmin(np.where(outside, s + limit, np.inf)))
            if not outside[column] or s[column] >= -limit[column]:
                break
            self.add(border, column, s)
        self.absorb(border)

    def add(self, border: Border, column: int, s: Vector) -> None:
        """Raise u_k until s_k = 0, dropping each active constraint whose multiplier reaches zero."""
        k = int(border.candidates[column])
        while self.pivots < self.max_pivots:
            self.pivots += 1
            active, (r, ds) = border.active, border.direction(column)
            curvature = float(ds[column])
            independent = curvature > 10 * (len(active) + 1) * EPS * self.G[k, k]
            full = -float(s[column]) / curvature if independent else np.inf
            falling = np.flatnonzero(r > 0)
            ratios = self.u[active[falling]] / r[falling]
            partial = float(ratios.min(initial=np.inf))
            step = min(full, partial)
            if not np.isfinite(step):
                raise np.linalg.LinAlgError(
                    f"constraint {k} depends on the active ones: G is not positive definite"
                )
            self.u[active] -= step * r
            self.u[k] += step
            s += step * ds
            if full <= partial:
                border.added.append(column)
                self.is_active[k] = True
                return
            self.drops += 1
            place = int(falling[np.argmin(ratios)])
            self.u[active[place]], self.is_active[active[place]] = 0.0, False
            border.drop(place)

    def absorb(self, border: Border) -> None:
        """Apply the changes of the border to C and its factor."""
        for position in sorted(border.removed, reverse=True):
            del self.C[position]
            self.factor.delete(position)
        C, E = np.array(self.C, dtype=np.intp), border.candidates[border.added]
        D = (
            self.factor.solve_transposed(self.G[np.ix_(C, E)])
            if border.removed
            else border.D[:, border.added]
        )
        self.factor.extend(D, sla.cholesky(self.G[np.ix_(E, E)] - D.T @ D, check_finite=False))
        self.C += E.tolist()
