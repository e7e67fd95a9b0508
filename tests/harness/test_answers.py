"""What a solver may return: plain types of it, or words."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from harness.conformance.known_problems import known_problems
from harness.solving.solver_answer import (
    LARGEST_DETAILS,
    GivenArrays,
    InvalidAnswer,
    checked,
    examined,
    figures,
)
from harness.solving.solver_session import no_answer
from problems.forms.problem import Problem, in_form
from solvers.base import Answer, Status


class Odd(Exception):
    def __str__(self) -> str:
        raise ValueError("no words")


class Raising:
    def __array__(self, *arguments: Any, **options: Any) -> Any:
        raise Odd

    def __repr__(self) -> str:
        raise ValueError("no text")


def nested(depth: int) -> list[Any]:
    deep: list[Any] = []
    for _ in range(depth):
        deep = [deep]
    return deep


LAM = np.ones(1)
#: What an answer may not hold, and what is said of it.
WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "complex": ({"lam": LAM + 0j}, "wanted real numbers"),
    "objects": ({"lam": LAM.astype(object)}, "wanted real numbers"),
    "truth": ({"lam": LAM > 0}, "wanted real numbers"),
    "masked": ({"lam": np.ma.masked_array(LAM, [True])}, "wanted real numbers"),
    "none": ({"lam": None}, "says solved, and gives no lam"),
    "raising": ({"lam": Raising()}, "lam is no array"),
    "ragged": ({"lam": [[1.0], [1.0, 2.0]]}, "no array"),
    "scalar": ({"lam": 1.0}, "has shape ()"),
    "empty": ({"lam": LAM[:0]}, "has shape (0,)"),
    "overflow": ({"lam": np.full(1, 1e4000, dtype=np.longdouble)}, "NaN or infinity"),
    "status": ({"status": np.array(["solved", "solved"])}, "status array("),
    "no status": ({"status": None}, "status None"),
    "fraction": ({"iterations": 1.5}, "iterations is 1.5"),
    "huge count": ({"iterations": 10**400}, "iterations is 1000"),
    "unprintable": ({"iterations": 10**5000}, "iterations is a int"),
    "negative": ({"inner_iterations": -1}, "inner_iterations is -1"),
    "no repr": ({"iterations": Raising()}, "iterations is a Raising"),
    "seconds": ({"reported_s": "fast"}, "reported_s is 'fast'"),
    "huge seconds": ({"reported_s": 10**400}, "reported_s is 1000"),
    "list": ({"details": [1]}, "details is [1]"),
    "deep": ({"details": {"a": nested(100_000)}}, "details is not JSON"),
    "huge number": ({"details": {"a": 10**400}}, "an integer of 401 digits"),
    "half a letter": ({"details": {"a": "\ud800"}}, "details is not JSON"),
}


def smallest() -> Problem:
    return in_form(known_problems()[0].prepared, "dual")


@pytest.mark.parametrize("name", WRONG)
def test_an_answer_that_is_none_is_refused(name: str) -> None:
    change, said = WRONG[name]
    with pytest.raises(InvalidAnswer, match=re.escape(said)):
        checked(replace(Answer("solved", LAM), **change), smallest())


def test_all_that_is_wrong_is_said_at_once() -> None:
    _, faults = examined(Answer("best", LAM * np.nan, iterations=-1), smallest())  # type: ignore[arg-type]
    assert [str(fault).split()[0] for fault in faults] == ["status", "lam", "iterations"]
    assert all(fault.fix for fault in faults)
    with pytest.raises(InvalidAnswer, match="solve returned NoneType"):
        checked(None, smallest())


def test_the_gate_makes_plain_types_that_nobody_can_change() -> None:
    lam = np.ones(1, dtype=np.float32)
    answer = Answer("solved", lam, [1, 2], np.int32(3), None, np.float32(0.5), {"a": np.ones(2)})  # type: ignore[arg-type]
    plain = checked(answer, smallest())
    assert [plain.lam.dtype, plain.x.dtype] == [np.float64] * 2
    assert [type(plain.iterations), type(plain.reported_s), plain.details] == [int, float, {"a": [1.0, 1.0]}]
    lam[:] = 7
    assert plain.lam == [1]
    with pytest.raises(ValueError, match="read-only"):
        plain.lam[0] = 7
    large = checked(replace(answer, details={"a": "x" * LARGEST_DETAILS}), smallest())
    assert large.details.keys() == {"dropped"}


@pytest.mark.parametrize(
    ("status", "details", "cause"),
    [
        ("failed", {"message": "singular KKT"}, "singular KKT"),
        ("failed", {"status": "InsufficientProgress"}, "InsufficientProgress"),
        ("inaccurate", {"cause": "rounding", "status": "MaxIterations"}, "rounding"),
        ("failed", {}, None),
        ("solved", {"status": "Solved"}, None),
    ],
)
def test_the_cause_in_library_words(status: Status, details: dict[str, str], cause: str | None) -> None:
    answer = Answer(status, None, details=details)
    assert figures(answer)["message"] == cause
    assert str(no_answer("osqp", answer)).count(": ".join(filter(None, (status, cause)))) == 1


def test_an_array_that_compiled_code_has_changed_is_told() -> None:
    array = np.ones((3, 2), order="F")
    given = GivenArrays([array, np.zeros(0)])
    given.check()
    array[1, 1] = 2.0
    with pytest.raises(InvalidAnswer, match="the solver changed the arrays that it was given"):
        given.check()
