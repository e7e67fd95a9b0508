"""An active-set Newton method for the dual problem min ½λᵀQλ − pᵀλ, λ ≥ 0.

    λ ≥ 0,   y = Qλ − p ≥ 0,   λᵀy = 0

For a guess C of the contact set, the linear equations λ_N = 0, y_C = 0 are solved and every index with a
wrong sign changes sides: Newton's method on min(λ, y) = 0 (Hintermüller, Ito and Kunisch, SIAM J.
Optim. 13:865–888, 2002), made finite by block principal pivoting. The equations are solved with a banded
M ≈ Q⁻¹ and corrected by products with Q, whatever the form and the share of closed contacts
(solvers/algorithms/newton_sweeps.py). Where Q does not decay along the joint, the equations of each set
are solved with a factor of Q_CC (closed_sets.py), in the sparse form with one of K.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from solvers.algorithms.newton_sweeps import MAX_SWEEPS, Sweeps
from solvers.base import Answer, Batch, LoadCase, Problem
from solvers.kkt import with_x
from solvers.method import Method, State


@dataclass(frozen=True, kw_only=True)
class _State(State):
    sweeps: Sweeps

    def solve(self, loads: Sequence[LoadCase], tolerance: float) -> list[Answer]:
        """The answers to one load case, or to several together."""
        sweeps, cases = self.sweeps, self.problem.prepared.with_p(loads)
        if len(cases) == 1:
            answers = [sweeps.answer(sweeps.solved(cases[0], tolerance, self.dual_start), tolerance)]
        else:
            answers = sweeps(cases, tolerance)
        return with_x(self.problem, answers, loads, tolerance)


class ActiveSetNewton(Method):
    """Active-set Newton, from the forces of the fasteners or a warm start; it stops by the rule of `Sweeps`.

    Iterations are sweeps, inner iterations contact sets tried with M; details count the products with Q.
    `Sweeps.answer` defines "solved"; in the sparse form the refined x decides (solvers/kkt.py).
    """

    forms = ("dual", "sparse")

    def state(self, problem: Problem) -> _State:
        sweeps = Sweeps(problem.prepared, most=self.most(MAX_SWEEPS), log=self.log)
        return _State(problem=problem, sweeps=sweeps)

    def batched(self, state: _State | Answer) -> Batch | None:
        return None if isinstance(state, Answer) else state.solve

    def solved(self, ready: _State, load: LoadCase, tolerance: float) -> Answer:
        return ready.solve([load], tolerance)[0]
