"""The paper's primal–dual interior-point method on the dual form min ½λᵀQλ − pᵀλ, λ ≥ 0.

By default: Algorithm 3 as printed (a full predictor step, then a second Newton system at the new point,
hence two matrices H per iteration), the systems solved by conjugate gradients preconditioned with
V = U + √D (eq. 15), from the start of Algorithm 5. Each option changes one ingredient.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from problems.forms.compliance import DenseCompliance
from solvers.algorithms.interior_point import (
    SCHEMES,
    CgExhausted,
    NewtonSteps,
    NoStart,
    Point,
    Start,
    algorithm_4,
    algorithm_5,
    mehrotra_start,
    stp1,
    stp2,
)
from solvers.algorithms.newton_system import NewtonSystem
from solvers.algorithms.preconditioner import SYSTEMS, OpenLast
from solvers.base import Answer, DualLoadCase, Problem, Status
from solvers.kkt import rounding_bound
from solvers.method import Method, State
from solvers.options import one_of, require

THETA = 0.995  # fraction of the step to the boundary
STALLED = 10  # iterations without progress before a restart, or the end
RESTARTS = ((1e-6, 0.9), (1e-9, 0.7))  # cg_tolerance and theta after a stall, at most
CONTACT_COMPLIANCE = 0.1  # mm/N
FEASIBILITY = 1e-3  # mm/√(N·mm): the error due to μ is proportional to √μ as well
RHO, LEAST_GAP = 0.1, 0.01  # of STP1 and STP2: residual allowed, of λᵀy; smallest gap, mm
MAX_ITERATIONS = 200  # per start or restart

#: The option `start`.
STARTS: dict[str, Callable[[Problem, DualLoadCase], Start]] = {
    "algorithm_5": lambda problem, load: algorithm_5(problem.Q, load.p),
    "algorithm_4": lambda problem, load: algorithm_4(problem.prepared, load),
    "stp1": lambda problem, load: stp1(problem.Q, load.p, RHO),
    "stp2": lambda problem, load: stp2(problem.Q, load.p, RHO, LEAST_GAP),
    "mehrotra": lambda problem, load: mehrotra_start(problem.Q, load.p),
}
ORDERINGS = ("lexicographic", "open_last")


@dataclass(frozen=True, kw_only=True)
class _State(State):
    system: NewtonSystem


@dataclass(kw_only=True, frozen=True, eq=False)
class Ipm(Method):
    """Primal–dual interior point.

    Stops when μ = λᵀy/m ≤ ε_μ and max(max(p − Qλ), λᵀ|s1| / Σλ) ≤ 1e-3 √ε_μ mm with s1 = y − (Qλ − p).
    ε_μ is the tolerance, in N·mm. The session passes tolerance/ℓ; divided again by ℓ = √load.energy it is an
    energy in scaled units. The paper tests μ alone, because it solves its systems exactly.
    Feasibility is not required below the rounding of each (Qλ − p)_i (`kkt.rounding_bound`). Each contact
    must also be decided: min(y_i, q_ii λ_i) is at most that rounding or √(0.1 mm/N · ε_μ), because a contact
    that touches without a force is off by √(μ q_ii). The root mean square of √(q_ii λ_i y_i) has the same
    limit; ε_μ implies it if q_ii ≤ 0.1 mm/N.

    The iteration stalls if the error of inexact systems in s1 outlasts y, or if a step ended too close to the
    boundary. It then restarts with a smaller cg_tolerance and theta (details: restarts).

    Options
    -------
    start : algorithm_5, algorithm_4 (the same point), stp1, stp2, mehrotra. If the first two find no
        feasible point, Mehrotra's start, which may be infeasible (details: start_instead).
    scheme : algorithm_3 as printed; mehrotra, the textbook's.
    preconditioner : V, U, none, splitting; direct is a Cholesky factorisation of every H instead.
    ordering : lexicographic, the nodes as they are numbered; open_last, with V only, by increasing D.
    cg_tolerance : ‖V⁻ᵀ(b − HΔλ)‖₂ ≤ cg_tolerance · ‖V⁻ᵀb‖₂ ends the conjugate gradients.
    max_cg : limit on the iterations of the conjugate gradients, in total.
    """

    start: str = "algorithm_5"
    scheme: str = "algorithm_3"
    preconditioner: str = "V"
    ordering: str = "lexicographic"
    cg_tolerance: float = 1e-3
    max_cg: float = np.inf

    def __post_init__(self) -> None:
        orderings = ORDERINGS if self.preconditioner == "V" else ORDERINGS[:1]
        require(
            "ipm",
            vars(self),
            start=one_of(self.start, STARTS),
            scheme=one_of(self.scheme, SCHEMES),
            preconditioner=one_of(self.preconditioner, SYSTEMS),
            ordering=(self.ordering in orderings, f"must be one of {ORDERINGS}, open_last with V only"),
            cg_tolerance=(0 < self.cg_tolerance < 1, "must lie in (0, 1)"),
            max_cg=(self.max_cg >= 1, "must be at least 1"),
        )

    def state(self, problem: Problem) -> _State:
        """The factors of Q."""
        kind = OpenLast if self.ordering == "open_last" else SYSTEMS[self.preconditioner]
        return _State(problem=problem, system=kind(problem.Q))

    def solved(self, ready: _State, load: DualLoadCase, tolerance: float) -> Answer:
        Q, system = ready.Q, ready.system
        tolerance /= load.energy**0.5
        system.begin()
        newton = NewtonSteps(DenseCompliance(Q), load.p, system, THETA, self.cg_tolerance, self.max_cg)
        details: dict[str, Any] = {"cg": newton.counts}
        start = self._start(ready.problem, load, details)  # Algorithm 3, step 2
        first = newton.at(start.lam, start.y)  # step 3
        details["start"] = {
            "mu": first.mu,
            "infeasibility_mm": float(abs(first.s1).max()),
            "corrections": start.corrections,
            "multiplications": start.multiplications,
        }
        status, cause, point = self._iterate(newton, first, tolerance)
        for restart, (cg_tolerance, theta) in enumerate(RESTARTS, start=1):
            if status != "inaccurate":
                break
            newton.cg_tolerance = min(newton.cg_tolerance, cg_tolerance)
            newton.theta = min(newton.theta, theta)
            status, cause, point = self._iterate(newton, first, tolerance)
            details["restarts"] = restart
        if newton.unconverged:
            details["cg_unconverged"] = newton.unconverged
        details |= {"mu": point.mu, "infeasibility": point.infeasibility()}
        details |= {"factorisations": system.factorisations} | ({"cause": cause} if cause else {})
        return Answer(
            status,
            point.lam if status != "failed" else None,
            iterations=len(newton.counts["predictor"]),
            inner_iterations=sum(map(sum, newton.counts.values())),
            details=details,
        )

    def _start(self, problem: Problem, load: DualLoadCase, details: dict[str, Any]) -> Start:
        try:
            return STARTS[self.start](problem, load)
        except NoStart as error:
            details["start_instead"] = f"mehrotra, because {error}"
            return mehrotra_start(problem.Q, load.p)

    def _iterate(self, newton: NewtonSteps, point: Point, tolerance: float) -> tuple[Status, str, Point]:
        """Algorithm 3, steps 4 to 8: status, cause and the last finite point."""
        smallest, stalled = np.inf, 0
        most = self.most(MAX_ITERATIONS)
        for _ in range(most):  # step 4
            measure = self._measure(newton, point, tolerance)
            self.log(mu=point.mu, infeasibility=point.infeasibility(), to_tolerance=measure)
            if measure <= 1:
                return "solved", "", point
            stalled = 0 if measure < smallest else stalled + 1
            smallest = min(smallest, measure)
            if stalled == STALLED or point.mu == 0.0:
                why = f"{newton.unconverged} unconverged CG solves" if newton.unconverged else "rounding"
                return "inaccurate", f"{why}: stalled at {smallest:.1e} × the required accuracy", point
            try:
                following = SCHEMES[self.scheme](newton, point)  # steps 5 to 7
            except CgExhausted:
                return "iteration_limit", f"max_cg = {self.max_cg:g} CG iterations reached", point
            except np.linalg.LinAlgError as error:
                return "inaccurate", f"Q + D is no longer positive definite: {error}", point
            values = np.concatenate([following.lam, following.y])
            if not (np.isfinite(values) & (values > 0)).all():
                return "failed", "λ or y is no longer finite and positive", point
            point = following
        return "iteration_limit", f"{most} iterations", point

    @np.errstate(over="ignore")
    def _measure(self, newton: NewtonSteps, point: Point, tolerance: float) -> float:
        """The largest ratio of a quantity of the stopping rule to what it may be."""
        force, y = np.diag(newton.system.Q) * point.lam, point.y
        rounding = rounding_bound(np.diag(newton.system.Q), newton.p, point.lam)
        feasible = np.maximum(FEASIBILITY * np.sqrt(tolerance), rounding)
        decided = np.maximum(np.sqrt(CONTACT_COMPLIANCE * tolerance), rounding)
        return max(
            point.mu / tolerance,
            point.infeasibility(feasible),
            float((np.minimum(y, force) / decided).max()),
            float(np.sqrt((force * y / decided**2).mean())),
        )
