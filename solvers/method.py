"""The base of this project's methods: a start, and a failed answer where a matrix is indefinite."""

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.stiffness.block import NotPositiveDefinite

from .base import Answer, DualLoadCase, DualStart, Form, LoadCase, Problem, Solver, WarmStart, failed


@dataclass(frozen=True, kw_only=True)
class State:
    """The data that load cases share. start : the solved case to start from, if there is one."""

    problem: Problem
    start: WarmStart | None = None

    @property
    def dual_start(self) -> DualStart | None:
        """The solved case, with p."""
        if self.start is None:
            return None
        (load,) = self.problem.prepared.with_p([self.start.load])
        return DualStart(load, self.start.lam, self.start.gap)

    @property
    def Q(self) -> Matrix:
        """(m, m) mm/N."""
        return self.problem.Q


class Method(Solver):
    """Base of the methods. A LinAlgError in `state` or `solved` makes a failed answer."""

    forms: tuple[Form, ...] = ("dual",)

    def prepare(self, data: Problem) -> Any:
        """The state; a failed answer if Q or K is not positive definite."""
        try:
            return self.state(data)
        except np.linalg.LinAlgError as error:
            return _indefinite(error, "Q")

    def update(self, state: Any, ready: Any, load: LoadCase, tolerance: float, start: WarmStart) -> Any:
        return state if isinstance(state, Answer) else replace(state, start=start)

    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
        if isinstance(ready, Answer):
            return ready
        try:
            return self.solved(ready, load, tolerance)
        except np.linalg.LinAlgError as error:
            return _indefinite(error, "a matrix of the method")

    def state(self, problem: Problem) -> Any:
        """The data that load cases share: a `State`, or a failed answer for all of them."""
        return State(problem=problem)

    def log(self, **figures: float) -> None:
        """Print a line with the figures of an iteration, where a log is kept."""
        if self.prints:
            print("  ".join(f"{name} {value:.6g}" for name, value in figures.items()))

    @abstractmethod
    def solved(self, ready: Any, load: Any, tolerance: float) -> Answer:
        """The answer to a load case: a DualLoadCase in the dual form."""


def _indefinite(error: np.linalg.LinAlgError, matrix: str) -> Answer:
    matrix = "K" if isinstance(error, NotPositiveDefinite) else matrix
    return failed(f"{matrix} is not positive definite: {error}")


def first_point(start: DualStart | None, load: DualLoadCase) -> tuple[Vector, Vector]:
    """λ (m,) N and y = Qλ − p (m,) mm from which a load case starts, without a product with Q."""
    if start is None:
        return np.zeros_like(load.p), -load.p
    return np.maximum(start.lam, 0.0), start.gap + start.load.p - load.p
