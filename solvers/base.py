"""What a solver is: up to five steps from the problem's data to an answer.

    convert(problem)             once an assembly   data into the library's own format
    prepare(data)                once an assembly   factorisations
    setup(state, load, tol)      once a load case   the library's own set-up
    solve(ready, load, tol)      once a load case   the answer

In a series of load cases on one assembly the first is set up so, and each that follows by

    update(state, ready, load, tol, near)           in the place of setup: the library's own way to the
                                                    next load case, a warm start

or, where a solver has `together(state)`, some at a time by what that returns.

Only `solve` must be written; each of the others hands on what it was given, and `update` sets up anew.
The harness calls and times them; a solver never reads a clock, scores itself or knows of limits.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from problems.forms.assembly import Assembly, Matrix, Prepared, Vector

Form = Literal["primal", "dual"]
FORMS: tuple[Form, Form] = ("primal", "dual")

#: What a solver may say of its own answer.
Status = Literal["solved", "inaccurate", "iteration_limit", "failed"]


@dataclass(frozen=True)
class Problem:
    """A prepared assembly in one of its two forms.

    primal: min ½xᵀKx − fᵀx, Aᵀx ≤ g    K = blockdiag(assembly.blocks), A sparse
    dual:   min ½λᵀQλ − pᵀλ, λ ≥ 0       Q dense

    The arrays are memory-mapped and read-only.
    """

    prepared: Prepared
    form: Form

    @property
    def assembly(self) -> Assembly:
        return self.prepared.assembly

    @property
    def Q(self) -> Matrix:
        return self.prepared.Q


@dataclass(frozen=True)
class Load:
    """One load case: f (n,) in N, g (m,) in mm, and p = AᵀK⁻¹f − g (m,) in mm for the dual form."""

    f: Vector
    g: Vector
    p: Vector


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


#: Takes many load cases of one assembly at once, and a tolerance: an answer to each load, in their order.
Together = Callable[[Sequence[Load], float], list[Answer]]


@dataclass(frozen=True)
class Near:
    """The answer of the solved load case that is nearest to the one to come.

    load : that case. lam : (m,) N. gap : (m,) mm, y = g − Aᵀx = Qλ − p. x : (n,) mm; None in the dual form.
    """

    load: Load
    lam: Vector
    gap: Vector
    x: Vector | None = None


class Solver(ABC):
    """Base of all solvers. Options are keyword arguments of the constructor, checked there."""

    #: The forms that the solver takes.
    forms: ClassVar[tuple[Form, ...]] = FORMS

    def convert(self, problem: Problem) -> Any:
        return problem

    def prepare(self, data: Any) -> Any:
        return data

    def setup(self, state: Any, load: Load, tolerance: float) -> Any:
        return state

    def update(self, state: Any, ready: Any, load: Load, tolerance: float, near: Near) -> Any:
        """What `solve` takes for a further load case of the same assembly and tolerance.

        state : from `prepare`. ready : from `setup` or `update` for the case solved before this one, which
        may be changed and returned. near : where a warm start may begin; the case before is another one.
        """
        return self.setup(state, load, tolerance)

    def together(self, state: Any) -> Together | None:
        """What takes many load cases of the assembly at once; None where there is no such way.

        state : from `prepare`.
        """
        return None

    @abstractmethod
    def solve(self, ready: Any, load: Load, tolerance: float) -> Answer: ...
