"""A fast primal–dual interior-point method on the dual form.

Mehrotra's predictor–corrector (one matrix, two right-hand sides per iteration) from the start STP2; Newton
systems by conjugate gradients with a banded M ≈ Q⁻¹; and, once most closed contacts are separated from open
ones, an exact finish on the active set it identified. The paper's method is `ipm`.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from problems.forms.compliance import DenseCompliance
from solvers.algorithms.interior_point import NewtonSteps, mehrotra, stp2
from solvers.algorithms.newton_sweeps import Sweeps
from solvers.algorithms.newton_system import Banded, Direct, NewtonSystem
from solvers.base import Answer, DualLoadCase, Problem, failed
from solvers.method import Method, State

THETA = 0.995
LEAST_GAP = 0.01  # mm, at the start
RHO = 10.0  # with 0.1 the start is up to a hundred times as large, and far from the solution
REFINEMENT = 1e-2  # ‖b − Hv‖ ≤ 1e-2 ‖b‖: per iteration, the error in y = Qλ − p shrinks by that or by 1 − α
MAX_ITERATIONS = 100
STALLED = 10
IDENTIFICATION_RATIO = 1e-4  # of the initial μ: above, a contact may look closed before it has moved
UNDECIDED = 1 / 4  # of the contacts, with 0.1 < q_ii λ_i / y_i < 10


@dataclass(frozen=True, kw_only=True)
class _State(State):
    system: NewtonSystem
    finish: Sweeps


class FastIpm(Method):
    """Interior point with an exact finish on the active set it identified.

    The finish, `newton` from C = {q_ii λ_i > y_i}, begins when μ = λᵀy/m has fallen to 1e-4
    of its initial value and at most m/4 contacts are undecided, or when the interior point ends; its status
    is the answer's. The interior point ends when the natural residual max|min(q_ii λ_i, (Qλ − p)_i)| is at
    most the tolerance, mm, or has not decreased for 10 iterations. Iterations are Newton matrices, inner
    iterations the finish's sweeps.
    """

    def state(self, problem: Problem) -> _State:
        """The state with M and the Newton systems."""
        finish = Sweeps(problem.prepared, log=self.log)
        system = Banded(problem.Q, finish.M) if finish.M else Direct(problem.Q)
        return _State(problem=problem, system=system, finish=finish)

    def solved(self, ready: _State, load: DualLoadCase, tolerance: float) -> Answer:
        Q, p, system = ready.Q, load.p, ready.system
        compliance = np.diag(Q)
        system.begin()
        newton = NewtonSteps(DenseCompliance(Q), p, system, THETA, REFINEMENT, np.inf)
        start = stp2(Q, p, RHO, LEAST_GAP)
        point = newton.at(start.lam, start.y)
        details: dict[str, Any] = {"start": {"mu": point.mu}}
        identifying_mu, least, stalled = IDENTIFICATION_RATIO * point.mu, np.inf, 0
        most = self.most(MAX_ITERATIONS)
        for k in range(most):
            ratio = compliance * point.lam / point.y
            undecided = int(((ratio > 0.1) & (ratio < 10)).sum())
            residual = float(abs(np.minimum(compliance * point.lam, point.gap)).max())
            stalled = 0 if residual < least else stalled + 1
            least = min(least, residual)
            figures = {"mu": point.mu, "natural_residual_mm": residual, "undecided": undecided}
            self.log(**figures)
            details |= figures
            done = residual <= tolerance or stalled == STALLED
            if done or (point.mu <= identifying_mu and undecided <= UNDECIDED * len(p)):
                case = ready.finish.solved(load, tolerance, C=ratio > 1)
                answer = ready.finish.answer(case, tolerance)
                details |= {name: value for name, value in answer.details.items() if name != "products"}
                return replace(answer, iterations=k, inner_iterations=answer.iterations, details=details)
            point = mehrotra(newton, point)
            if not np.isfinite(point.mu):
                return failed("λ or y overflowed", k)
        details["cause"] = f"{most} iterations"
        return Answer("iteration_limit", point.lam, iterations=most, details=details)
