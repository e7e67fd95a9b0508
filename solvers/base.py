"""What a solver is: up to five steps from the problem's data to an answer.

    convert(problem)             once per assembly    data into the library's own format
    prepare(data)                once per assembly    factorisations
    setup(state, load, tol)      once per load case   the library's own set-up
    solve(ready, load, tol)      once per load case   the answer

In a series of load cases on one assembly the first is set up so, and each that follows by

    update(state, ready, load, tol, start)          instead of setup: the library's own way to the next
                                                    load case, a warm start

or, if a solver has `batched(state)`, several at a time by the function that it returns.

Only `solve` must be written; each of the others passes on what it was given, and `update` sets up anew.
The harness calls and times them; a solver never reads a clock, scores itself or knows of limits.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from problems.forms.assembly import LoadCase, Vector
from problems.forms.names import FORMS, Form
from problems.forms.problem import Problem

__all__ = [
    "FORMS",
    "Answer",
    "Batch",
    "Form",
    "LoadCase",
    "Problem",
    "Solver",
    "Status",
    "WarmStart",
    "failed",
]

#: What a solver may say of its own answer.
Status = Literal["solved", "inaccurate", "iteration_limit", "failed"]


@dataclass(frozen=True)
class Answer:
    """What a solver returns.

    lam : (m,) contact forces λ in N (the multipliers of Aᵀx ≤ g).
    x : (n,) displacements in mm; None in the dual form, where x = K⁻¹(f − Aλ) is recovered.
    iterations : outer iterations; for an active-set method its changes of the set.
    inner_iterations : e.g. conjugate-gradient iterations.
    reported_s : seconds by the solver's own clock, if it has one.
    details : anything else worth keeping that JSON can hold.
    """

    status: Status
    lam: Vector | None
    x: Vector | None = None
    iterations: int | None = None
    inner_iterations: int | None = None
    reported_s: float | None = None
    details: dict[str, Any] = field(default_factory=dict)


def failed(cause: str, iterations: int | None = None) -> Answer:
    """No answer, and why."""
    return Answer("failed", None, iterations=iterations, details={"cause": cause})


#: Takes several load cases of one assembly, and a tolerance: an answer to each, in their order.
Batch = Callable[[Sequence[LoadCase], float], list[Answer]]


@dataclass(frozen=True)
class WarmStart:
    """The answer of the solved load case that is nearest to the next one.

    load : that case. lam : (m,) N. gap : (m,) mm, y = g − Aᵀx = Qλ − p. x : (n,) mm; None in the dual form.
    """

    load: LoadCase
    lam: Vector
    gap: Vector
    x: Vector | None = None


class Solver(ABC):
    """Base of all solvers. Options are keyword arguments of the constructor, checked there."""

    #: The forms that the solver takes.
    forms: ClassVar[tuple[Form, ...]] = FORMS
    #: The distribution that solves, if it has another name than the solver.
    distribution: ClassVar[str | None] = None

    def convert(self, problem: Problem) -> Any:
        return problem

    def prepare(self, data: Any) -> Any:
        return data

    def setup(self, state: Any, load: LoadCase, tolerance: float) -> Any:
        return state

    def update(self, state: Any, ready: Any, load: LoadCase, tolerance: float, start: WarmStart) -> Any:
        """What `solve` takes for a further load case of the same assembly and tolerance.

        state : from `prepare`. ready : from `setup` or `update` for the case solved before this one, which
        may be changed and returned. start : where a warm start may begin; the case before is another one.
        """
        return self.setup(state, load, tolerance)

    def batched(self, state: Any) -> Batch | None:
        """What takes several load cases of the assembly at once; None if there is no such way.

        state : from `prepare`.
        """
        return None

    @abstractmethod
    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer: ...
