"""What SciPy's minimisers share: min ½λᵀQλ − pᵀλ, λ ≥ 0, by its objective, gradient and bounds."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from scipy.sparse.linalg import LinearOperator

from problems.forms.assembly import Matrix, Vector

from .adapter import Converted, dense
from .base import Form, LoadCase, Problem, Solver, Status, WarmStart


class Objective:
    """½λᵀQλ − pᵀλ, N·mm, and its gradient y = Qλ − p, mm. products : with Q."""

    def __init__(self, Q: Matrix, p: Vector) -> None:
        self.Q, self.p, self.products = Q, p, 0

    def __call__(self, lam: Vector) -> tuple[float, Vector]:
        y = self.times_Q(lam) - self.p
        return float(lam @ (y - self.p)) / 2, y

    def hessian(self, lam: Vector) -> LinearOperator:
        return LinearOperator(self.Q.shape, matvec=self.times_Q, dtype=np.float64)

    def times_Q(self, v: Vector) -> Vector:
        self.products += 1
        product: Vector = self.Q @ v
        return product

    @property
    def bounds(self) -> list[tuple[float, None]]:
        return [(0.0, None)] * len(self.p)


class Minimizer(Solver):
    """Base of these solvers. They start from λ = 0 or a warm start."""

    forms: ClassVar[tuple[Form, ...]] = ("dual",)
    distribution = "scipy"

    def convert(self, problem: Problem) -> Converted:
        return Converted(problem, dense(problem.blocks))

    def setup(self, state: Converted, load: LoadCase, tolerance: float) -> tuple[Converted, Vector]:
        return state, np.zeros_like(load.p)

    def update(
        self, state: Converted, ready: object, load: LoadCase, tolerance: float, start: WarmStart
    ) -> tuple[Converted, Vector]:
        return state, np.maximum(start.lam, 0.0)


def status_of(lam: Vector, y: Vector, tolerance: float, at_limit: bool) -> Status:
    """Of an answer with y = Qλ − p, whatever the minimiser says of it.

    "solved" if the projected gradient max|λ − max(λ − y, 0)| is at most the tolerance; in it a force in N
    stands beside a gap in mm.
    """
    if float(abs(lam - np.maximum(lam - y, 0.0)).max(initial=0.0)) <= tolerance:
        return "solved"
    return "iteration_limit" if at_limit else "inaccurate"
