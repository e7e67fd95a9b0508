"""The interface of a solver: up to five steps from the problem's data to an answer.

    convert(problem)             once per assembly    data into the library's own format
    prepare(data)                once per assembly    factorisations
    setup(state, load, tol)      once per load case   the library's own set-up
    solve(ready, load, tol)      once per load case   the answer

In a series of load cases on one assembly, all but the first are set up by

    update(state, ready, load, tol, start)          instead of setup: a warm start, or the library's own
                                                    update of the data

or solved several at a time by the function that `batched(state)` returns, if a solver has it.

Only `solve` must be written: by default, the other steps pass on their argument, and `update` calls `setup`.
The harness calls and times the steps; a solver never reads a clock, judges its answer or handles limits.

Options of a method, and settings of a library that a user may choose (OSQP's scaling), are checked here.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from problems.errors import Fault, InputError
from problems.forms import DENSE_FORMS as DENSE_FORMS
from problems.forms import FORMS as FORMS
from problems.forms import Form as Form
from problems.forms.assembly import DualLoadCase as DualLoadCase
from problems.forms.assembly import LoadCase as LoadCase
from problems.forms.assembly import Vector
from problems.forms.problem import Problem as Problem
from problems.input.bounded_types import unknown

#: A solver's report on its own answer.
Status = Literal["solved", "inaccurate", "iteration_limit", "failed"]


@dataclass(frozen=True)
class Answer:
    """What a solver returns.

    lam : (m,) contact forces λ in N (the multipliers of Aᵀx ≤ g).
    x : (n,) displacements in mm; None in the dual form, where x = K⁻¹(f − Aλ) is recovered.
    iterations : outer iterations; in an active-set method, changes of the set.
    inner_iterations : e.g. conjugate-gradient iterations.
    reported_s : seconds by the solver's own clock, if it has one.
    details : anything else to record, as JSON types.
    """

    status: Status
    lam: Vector | None
    x: Vector | None = None
    iterations: int | None = None
    inner_iterations: int | None = None
    reported_s: float | None = None
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def cause(self) -> str | None:
        """The reason why it is not solved, in the words of the method or of its library, if they say one."""
        said = [self.details.get(name) for name in ("cause", "message", "status")]
        return None if self.status == "solved" else next((str(text) for text in said if text), None)


def failed(cause: str, iterations: int | None = None) -> Answer:
    """An answer without forces, and its cause."""
    return Answer("failed", None, iterations=iterations, details={"cause": cause})


#: (load cases of one assembly, tolerance) → an answer to each, in their order.
Batch = Callable[[Sequence[LoadCase], float], list[Answer]]


@dataclass(frozen=True)
class WarmStart:
    """The answer to the solved load case nearest to the next one.

    load : that case. lam : (m,) N. gap : (m,) mm, y = g − Aᵀx = Qλ − p. x : (n,) mm; None in the dual form.
    """

    load: LoadCase
    lam: Vector
    gap: Vector
    x: Vector | None = None


@dataclass(frozen=True)
class DualStart(WarmStart):
    """A warm start whose load case has p."""

    load: DualLoadCase


class Solver(ABC):
    """Base of all solvers. Options are keyword arguments of the constructor, checked there."""

    #: The forms that the solver takes; in the sparse one, blocks and G are SciPy's sparse arrays.
    forms: ClassVar[tuple[Form, ...]] = DENSE_FORMS
    #: The distribution of the library, if it has another name than the solver.
    distribution: ClassVar[str | None] = None

    def convert(self, problem: Problem) -> Any:
        return problem

    def prepare(self, data: Any) -> Any:
        return data

    def setup(self, state: Any, load: LoadCase, tolerance: float) -> Any:
        return state

    def update(self, state: Any, ready: Any, load: LoadCase, tolerance: float, start: WarmStart) -> Any:
        """The argument `ready` of `solve` for another load case of the same assembly and tolerance.

        state : from `prepare`. ready : from `setup` or `update` for the case solved before this one; may be
        changed and returned. start : a warm start, not necessarily from the case before.
        """
        return self.setup(state, load, tolerance)

    def batched(self, state: Any) -> Batch | None:
        """A function that solves several load cases of the assembly at once; None if there is none.

        state : from `prepare`.
        """
        return None

    @abstractmethod
    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer: ...


#: Beginnings of what the adapters decide: accuracy, limits, output.
STOPPING = ("eps", "tol", "reduced_tol", "max_iter", "check_du", "time", "compute_timings")
DECIDED = (*STOPPING, "verbose", "max_threads", "num_threads", "warm_start", "initial_guess")


def require(solver: str, options: Mapping[str, object], **rules: tuple[bool, str]) -> None:
    """Raises InputError, all faults at once. rules : by option, whether its value is allowed, and what is."""
    faults = [
        Fault(f"solver {solver}", f"options.{key}", options[key], allowed)
        for key, (holds, allowed) in rules.items()
        if not holds
    ]
    if faults:
        raise InputError(faults)


def one_of(value: object, allowed: Collection[object]) -> tuple[bool, str]:
    """A rule: `value` is one of `allowed`, of the same type (1 is not True)."""
    found = any(type(value) is type(good) and value == good for good in allowed)
    return found, f"must be one of {', '.join(map(repr, allowed))}"


def chosen(solver: str, given: Mapping[str, object], settings: object) -> dict[str, Any]:
    """The settings given. settings : the library's own, at their defaults, on which they are tried.

    Raises InputError, all faults at once.
    """
    known = {
        name: value
        for name in dir(settings)
        if not name.startswith(("_", *DECIDED))
        and isinstance(value := getattr(settings, name), bool | int | float | str)
    }
    require(solver, given, **{name: _of_its_type(name, value, known) for name, value in given.items()})
    apply(settings, given)
    return dict(given)


def apply(settings: Any, given: Mapping[str, object]) -> None:
    """Set them on the library's settings."""
    for name, value in given.items():
        setattr(settings, name, value)


def _of_its_type(name: str, value: object, known: Mapping[str, object]) -> tuple[bool, str]:
    if name not in known:
        return False, unknown("option", name, sorted(known))
    kind = type(known[name])
    # bool is an int, and an int a float where one is meant.
    fits = type(value) is kind or (kind is float and type(value) is int)
    return fits, f"must be of the type of its default {known[name]!r}"
