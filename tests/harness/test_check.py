"""Each solver here has one fault; `check` must name it, and must find nothing in the one without."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.conformance.check import run
from problems.errors import InputError
from problems.forms.assembly import LoadCase
from solvers.base import FORMS, Answer, Form, Problem, Solver, WarmStart
from solvers.registry import make_solver


class Sound(Solver):
    """Piqp in a wrapper whose answer a subclass spoils."""

    forms: tuple[Form, ...] = ("primal", "dual")  # type: ignore[misc]

    def __init__(self) -> None:
        self.inner = make_solver("piqp", {})

    def convert(self, problem: Problem) -> Any:
        self.problem = problem
        return self.inner.convert(problem)

    def setup(self, state: Any, load: LoadCase, tolerance: float) -> Any:
        return self.inner.setup(state, load, tolerance)

    def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
        return self.spoil(self.inner.solve(ready, load, tolerance), load)

    def spoil(self, answer: Answer, load: LoadCase) -> Answer:
        return answer


def spoiling(change: Callable[[Answer], Any]) -> type[Sound]:
    class Spoilt(Sound):
        def spoil(self, answer: Answer, load: LoadCase) -> Answer:
            return change(answer)

    return Spoilt


def words_of(solver: type[Solver], forms: tuple[Form, ...] = FORMS) -> str:
    return "\n".join(map(str, run(solver, forms)))


def lam_of(answer: Answer) -> np.ndarray:
    assert answer.lam is not None
    return answer.lam


def test_a_sound_solver_has_no_findings() -> None:
    assert run(Sound) == []


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda a: replace(a, lam=lam_of(a)[:-1]), "lam has shape"),
        (lambda a: replace(a, lam=np.full_like(lam_of(a), np.nan)), "lam has NaN or infinity"),
        (lambda a: replace(a, lam=-lam_of(a)), "lam has the wrong sign"),
        (lambda a: replace(a, lam=2 * lam_of(a)), "mm off (limit 1e-07 mm at tolerance 1e-09), and yet"),
        (lambda a: replace(a, lam=lam_of(a) * (1 + 1e-5), status="inaccurate"), 'status "inaccurate"'),
        (lambda a: replace(a, lam=None, x=None), "says solved, and gives no"),
        (lambda a: replace(a, lam=None, status="failed"), 'lam is None, status "failed"'),
        (lambda a: replace(a, status="failed"), 'status is "failed" beside a right answer'),
        (lambda a: replace(a, status="optimal"), "status 'optimal'; allowed: solved, inaccurate"),
        (lambda a: a.lam, "solve returned ndarray"),
    ],
)
@pytest.mark.parametrize("form", ["primal", "dual"])
def test_a_fault_is_named(change: Callable[[Answer], Any], expected: str, form: Form) -> None:
    words = words_of(spoiling(change), (form,))
    assert expected in words
    assert f"[{form}]" in words


def test_a_primal_answer_needs_right_displacements() -> None:
    assert "gives no x" in words_of(spoiling(lambda a: replace(a, x=None)), ("primal",))

    def moved(answer: Answer) -> Answer:
        return answer if answer.x is None else replace(answer, x=answer.x + 2e-7)

    assert "x is 2e-07 mm off" in words_of(spoiling(moved), ("primal",))
    assert run(spoiling(moved), ("dual",)) == []


def test_a_tolerance_that_is_ignored() -> None:
    class Deaf(Sound):
        def setup(self, state: Any, load: LoadCase, tolerance: float) -> Any:
            return self.inner.setup(state, load, 1e-1)

    words = words_of(Deaf, ("dual",))
    assert "it ignores the tolerance" in words
    assert "and yet status is" in words


def test_arrays_that_are_changed() -> None:
    class Writes(Sound):
        def setup(self, state: Any, load: LoadCase, tolerance: float) -> Any:
            load.p[0] += 1.0
            return super().setup(state, load, tolerance)

    assert "copy, then write" in words_of(Writes, ("dual",))

    class WritesByForce(Sound):
        """As a compiled extension would, which does not look at the read-only flag."""

        def solve(self, ready: Any, load: LoadCase, tolerance: float) -> Answer:
            answer = super().solve(ready, load, tolerance)
            load.f.flags.writeable = True
            load.f[-1] += 1e-13 * max(1.0, abs(load.f[-1]))
            load.f.flags.writeable = False
            return answer

    assert "changed the arrays that it was given" in words_of(WritesByForce, ("dual",))


def test_an_answer_that_is_not_repeatable() -> None:
    random = np.random.default_rng(1)

    class Jitter(Sound):
        def spoil(self, answer: Answer, load: LoadCase) -> Answer:
            lam = lam_of(answer)
            return replace(answer, lam=lam * (1 + 1e-7 * random.uniform(0.5, 1)))

    assert "not repeatable" in words_of(Jitter, ("dual",))


class Remembers(Sound):
    """Solves every load case on a state as if it were the first one."""

    def prepare(self, data: Any) -> Any:
        self.first: LoadCase | None = None
        return data

    def setup(self, state: Any, load: LoadCase, tolerance: float) -> Any:
        self.first = self.first or load
        return self.inner.setup(state, self.first, tolerance)


class Stale(Sound):
    def update(self, state: Any, ready: Any, load: LoadCase, tolerance: float, near: WarmStart) -> Any:
        return ready


class TakesTheNearAnswer(Sound):
    near: WarmStart | None = None

    def update(self, state: Any, ready: Any, load: LoadCase, tolerance: float, near: WarmStart) -> Any:
        self.near = near
        return super().update(state, ready, load, tolerance, near)

    def spoil(self, answer: Answer, load: LoadCase) -> Answer:
        return replace(answer, lam=self.near.lam) if self.near else answer


@pytest.mark.parametrize(
    ("solver", "way"),
    [
        (Remembers, "as a second load case"),
        *((each, "as a series by `update`") for each in (Stale, TakesTheNearAnswer)),
    ],
)
def test_what_is_right_alone_and_wrong_after_another_case(solver: type[Solver], way: str) -> None:
    first, *_ = words_of(solver, ("dual",)).splitlines()
    assert f"right when solved alone, wrong {way} (others closed" in first


def test_an_error_within_a_library_is_named_with_the_line_that_calls_it() -> None:
    class Raises(Sound):
        def setup(self, state: Any, load: LoadCase, tolerance: float) -> Any:
            return np.linalg.cholesky(-np.eye(2))

    words = words_of(Raises, ("dual",))
    assert "setup: raised LinAlgError: Matrix is not positive definite" in words
    assert "test_check.py, line" in words


def test_a_form_that_there_is_not_is_refused() -> None:
    """In no form, every solver was sound."""
    forms: Any = ("daul",)
    with pytest.raises(InputError, match=r"check_solver: forms = \['daul'\]: some of"):
        run(Sound, forms)


def test_wrong_forms_and_a_failing_constructor() -> None:
    class Wrong(Sound):
        forms = ("both",)  # type: ignore[assignment]

    class Fails(Sound):
        def __init__(self) -> None:
            raise KeyError("x")

    assert "forms is ('both',)" in words_of(Wrong)
    assert "constructor: raised KeyError" in words_of(Fails)


def test_a_limit_of_its_own_that_a_run_replaces() -> None:
    class Limited(Sound):
        def __init__(self) -> None:
            super().__init__()
            self.iteration_limit = 500

    assert "iteration_limit is 500. Choose another name" in words_of(Limited, ("dual",))


def test_load_cases_at_once_in_another_order() -> None:
    class Turned(Sound):
        def batched(self, state: Any) -> Any:
            def answers(loads: Any, tolerance: float) -> list[Answer]:
                ready = [self.setup(state, load, tolerance) for load in loads]
                return [self.solve(*each, tolerance) for each in zip(ready, loads, strict=True)][::-1]

            return answers

    class Short(Sound):
        def batched(self, state: Any) -> Any:
            return lambda loads, tolerance: []

    class Raising(Sound):
        def batched(self, state: Any) -> Any:
            return lambda loads, tolerance: loads.pop(9)

    assert "wrong when solved at once by `batched`" in words_of(Turned, ("dual",))
    assert "0 answers to" in words_of(Short, ("dual",))
    assert "batched: raised IndexError" in words_of(Raising, ("dual",))
