"""A solver's answer: whether it is valid, its figures for the row; arrays that it may not change."""

import json
from collections.abc import Callable, Iterable
from numbers import Integral, Real
from pathlib import Path
from typing import Any, get_args
from zlib import crc32

import numpy as np

from harness.results.records import to_line
from harness.results.schema import Report
from problems.forms.assembly import Matrix, Vector
from problems.forms.problem import Problem
from solvers.base import Answer, Status

LARGEST_COUNT = 2**53  # every reader of JSON keeps integers up to it
COUNT = "a whole number from 0 to 2⁵³"
LARGEST_DETAILS = 2**16  # characters of JSON; larger ones are dropped
LONGEST_SHOWN = 80  # characters of a value in a message
LONGEST_ERROR = 2000  # characters of an exception's text


class InvalidAnswer(Exception):
    """The answer is invalid; the text says why. status : of its row. fix : what to do about it."""

    status = "failed"

    def __init__(self, wrong: str, fix: str = "") -> None:
        super().__init__(wrong)
        self.fix = fix


def checked(answer: object, problem: Problem) -> Answer:
    """The answer in plain types. Raises InvalidAnswer. Everything that a solver returns passes here."""
    plain, faults = examined(answer, problem)
    if faults:
        raise faults[0]
    needed = problem.needs[-1]  # x in a form that gives it: forces may be missing there
    if plain.status == "solved" and getattr(plain, needed) is None:
        raise InvalidAnswer(f"says solved, and gives no {needed}")
    return plain


def examined(answer: object, problem: Problem) -> tuple[Answer, list[InvalidAnswer]]:
    """The answer in plain types, with None for each invalid part, and all that is wrong with it.

    lam (m,) and x (n,) become read-only float64 copies, iterations integers, details plain JSON, dropped if
    it is large.
    """
    if not isinstance(answer, Answer):
        wrong = f"solve returned {type(answer).__name__}, not solvers.base.Answer"
        return Answer("failed", None), [InvalidAnswer(wrong, "Return a solvers.base.Answer")]
    faults: list[InvalidAnswer] = []

    def plain(convert: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return convert(*arguments)
        except InvalidAnswer as fault:
            faults.append(fault)
            return None

    converted = Answer(
        plain(_status, answer.status),
        plain(vector, "lam", answer.lam, problem.assembly.m),
        plain(vector, "x", answer.x, problem.assembly.n),
        plain(_number, "iterations", answer.iterations, Integral, COUNT),
        plain(_number, "inner_iterations", answer.inner_iterations, Integral, COUNT),
        plain(_number, "reported_s", answer.reported_s, Real, "seconds"),
        plain(_plain, answer.details),
    )
    return converted, faults


def _status(value: Any) -> Any:
    if not isinstance(value, str) or value not in get_args(Status):
        wrong = f"status {shown(value)}; allowed: {', '.join(get_args(Status))}"
        raise InvalidAnswer(wrong, "Say how it ended in one of these words")
    return value


def vector(name: str, value: Any, size: int) -> Vector | None:
    """A read-only copy of `value` as (size,) float64; None for None.

    Raises InvalidAnswer unless it is real (integers or floats of any precision), finite and of that shape.
    """
    if value is None:
        return None
    fix = f"Return {name} as a numpy array of float64; without an answer, None and a status that says so"
    try:
        array = np.asarray(value)
    except Exception as error:
        raise InvalidAnswer(f"{name} is no array: {error_text(error)}", fix) from error
    if array.dtype.kind not in "fiu" or isinstance(value, np.ma.MaskedArray):
        raise InvalidAnswer(f"{name} is {type(value).__name__} of {array.dtype}; wanted real numbers", fix)
    if array.shape != (size,):
        raise InvalidAnswer(f"{name} has shape {array.shape}; wanted ({size},)", fix)
    with np.errstate(over="ignore"):
        plain = np.array(array, dtype=np.float64)
    if not np.isfinite(plain).all():
        raise InvalidAnswer(f"{name} has NaN or infinity", fix)
    plain.flags.writeable = False
    return plain


def _number(name: str, value: Any, kind: Any, wanted: str) -> Any:
    """A number of a kind, from 0 to 2⁵³; None for None."""
    if value is None:
        return None
    if not (isinstance(value, kind) and 0 <= value < LARGEST_COUNT):
        raise InvalidAnswer(f"{name} is {shown(value)}; wanted {wanted}", f"Give {wanted}, or None")
    return int(value) if kind is Integral else float(value)


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


def _plain(details: object) -> dict[str, Any]:
    fix = "Put only numbers, text, lists and dicts there"
    if not isinstance(details, dict):
        raise InvalidAnswer(f"details is {shown(details)}; wanted a dict", fix)
    try:
        text = to_line(details)
        if len(text) > LARGEST_DETAILS:
            return {"dropped": f"{len(text)} characters"}
        plain: dict[str, Any] = json.loads(text, parse_int=_bounded)
        json.dumps(plain, ensure_ascii=False).encode()  # no lone surrogates
    except Exception as error:
        raise InvalidAnswer(f"details is not JSON: {error_text(error)}", fix) from error
    return plain


def _bounded(digits: str) -> int:
    value = int(digits)
    if abs(value) > LARGEST_COUNT:
        raise ValueError(f"an integer of {len(digits)} digits")
    return value


def figures(answer: Answer) -> Report:
    """The fields of the row that the solver reports."""
    return {
        "iterations": answer.iterations,
        "inner_iterations": answer.inner_iterations,
        "solver_reported_s": answer.reported_s,
        "message": answer.cause,
        "details": answer.details,
        **({"device": str(answer.details["device"])} if "device" in answer.details else {}),
    }


class GivenArrays:
    """The arrays that a solver is given, as they are now: the files of memory-mapped ones, a sum of others.

    Compiled code writes into them whatever their flags say.
    """

    def __init__(self, arrays: Iterable[Matrix]) -> None:
        self.files, self.others = set[Path](), list[Matrix]()
        for array in arrays:
            if isinstance(array, np.memmap) and array.filename:
                self.files.add(Path(array.filename))
            else:
                self.others.append(array)
        self.states = {path: _state(path) for path in self.files}
        self.sums = [*map(_sum, self.others)]

    def check(self) -> None:
        """Raises InvalidAnswer if a file was written, replaced or deleted since, or an array changed."""
        changed = sorted({str(path.parent) for path in self.files if _state(path) != self.states[path]})
        if changed:
            raise InvalidAnswer(f"the solver wrote into the cache: delete {', '.join(changed)}")
        if [*map(_sum, self.others)] != self.sums:
            raise InvalidAnswer("the solver changed the arrays that it was given: copy, then write")


def _sum(array: Matrix) -> int:
    """A checksum of the content of an array, in any order of its axes."""
    return crc32(array.ravel(order="K").data)


def _state(path: Path) -> tuple[int, ...]:
    """What writing changes of a file. ctime : no program can set it back."""
    try:
        stat = path.stat()
    except OSError:
        return ()
    return stat.st_ino, stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns
