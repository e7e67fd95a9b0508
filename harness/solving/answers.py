"""A solver's answer: whether it is valid, its figures for the row, and its file."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import inf
from numbers import Integral, Real
from pathlib import Path
from typing import Any, get_args

import numpy as np

from harness.results.records import Row, replace_arrays, to_line
from problems.forms.assembly import Vector
from problems.forms.problem import Problem
from solvers.base import Answer, Status

LARGEST_COUNT = 2**53  # every reader of JSON keeps integers up to it
LARGEST_DETAILS = 2**16  # characters of JSON; larger ones are dropped
LONGEST_SHOWN = 80  # characters of a value in a message
LONGEST_ERROR = 2000  # characters of an exception's text


class InvalidAnswer(Exception):
    """The answer is invalid; the text says why. status : what the row says of it."""

    status = "failed"


def checked(answer: object, problem: Problem) -> Answer:
    """The answer in plain types; everything that a solver returns passes here.

    lam (m,) and x (n,) become float64 arrays of their own, read-only; iterations integers; details plain
    JSON, dropped if it is large. Raises InvalidAnswer if type, status, shapes or values are wrong, as of a
    complex λ.
    """
    if not isinstance(answer, Answer):
        raise InvalidAnswer(f"solve returned {type(answer).__name__}, not solvers.base.Answer")
    if not isinstance(answer.status, str) or answer.status not in get_args(Status):
        raise InvalidAnswer(f"status {shown(answer.status)}; allowed: {', '.join(get_args(Status))}")
    needed = problem.needs[-1]  # x in a form that gives it: forces may be missing there
    if answer.status == "solved" and getattr(answer, needed) is None:
        raise InvalidAnswer(f"says solved, and gives no {needed}")
    return Answer(
        answer.status,
        vector("lam", answer.lam, problem.assembly.m),
        vector("x", answer.x, problem.assembly.n),
        _number(int, "iterations", answer.iterations),
        _number(int, "inner_iterations", answer.inner_iterations),
        _number(float, "reported_s", answer.reported_s),
        _plain(answer.details),
    )


def vector(name: str, value: Any, size: int) -> Vector | None:
    """A read-only copy of `value` as (size,) float64; None for None.

    Raises InvalidAnswer unless it is real (integers or floats of any precision), finite and of that shape.
    """
    if value is None:
        return None
    try:
        given = np.asarray(value)
    except Exception as error:
        raise InvalidAnswer(f"{name} is no array: {error_text(error)}") from error
    if given.dtype.kind not in "fiu" or isinstance(value, np.ma.MaskedArray):
        raise InvalidAnswer(f"{name} is {type(value).__name__} of {given.dtype}; wanted real numbers")
    if given.shape != (size,):
        raise InvalidAnswer(f"{name} has shape {given.shape}; wanted ({size},)")
    with np.errstate(over="ignore"):
        plain = np.array(given, dtype=np.float64)
    if not np.isfinite(plain).all():
        raise InvalidAnswer(f"{name} has NaN or infinity")
    plain.flags.writeable = False
    return plain


def is_count(value: object) -> bool:
    """Whether it can be a number of iterations."""
    return isinstance(value, Integral) and 0 <= int(value) < LARGEST_COUNT


def is_seconds(value: object) -> bool:
    try:
        return isinstance(value, Real) and 0 <= float(value) < inf
    except OverflowError:  # an integer beyond the range of floats
        return False


def shown(value: object) -> str:
    """The value in a message, shortened."""
    try:
        text = repr(value)
    except Exception:  # of a class of the user's, or an integer of too many digits
        text = f"a {type(value).__name__}"
    return text if len(text) <= LONGEST_SHOWN else text[: LONGEST_SHOWN - 1] + "…"


def error_text(error: BaseException) -> str:
    """Type and text of an error, shortened."""
    try:
        return f"{type(error).__name__}: {error}"[:LONGEST_ERROR]
    except Exception:  # of a class of the user's
        return type(error).__name__


def _number(kind: Callable[[Any], Any], name: str, value: Any) -> Any:
    fits, wanted = (is_count, "a whole number from 0 to 2⁵³") if kind is int else (is_seconds, "seconds")
    if value is not None and not fits(value):
        raise InvalidAnswer(f"{name} is {shown(value)}; wanted {wanted}")
    return None if value is None else kind(value)


def _plain(details: object) -> dict[str, Any]:
    if not isinstance(details, dict):
        raise InvalidAnswer(f"details is {shown(details)}; wanted a dict")
    try:
        text = to_line(details)
        if len(text) > LARGEST_DETAILS:
            return {"dropped": f"{len(text)} characters"}
        plain: dict[str, Any] = json.loads(text, parse_int=_bounded)
        json.dumps(plain, ensure_ascii=False).encode()  # no lone surrogates
    except Exception as error:
        raise InvalidAnswer(f"details is not JSON: {error_text(error)}") from error
    return plain


def _bounded(digits: str) -> int:
    value = int(digits)
    if abs(value) > LARGEST_COUNT:
        raise ValueError(f"an integer of {len(digits)} digits")
    return value


def figures(answer: Answer) -> Row:
    """What the solver reports, for the row."""
    return {
        "iterations": answer.iterations,
        "inner_iterations": answer.inner_iterations,
        "solver_reported_s": answer.reported_s,
        "details": answer.details,
    }


def save(path: Path, x: Vector, lam: Vector | None, m: int) -> None:
    """x (n,) in mm and lam (m,) in N, NaN if the solver gives none; written atomically."""
    replace_arrays(path, {"x": x, "lam": np.full(m, np.nan) if lam is None else lam})
