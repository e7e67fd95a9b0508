"""What is wrong with one answer to a problem whose answer is known, in plain words."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import get_args

import numpy as np

from harness.solving.answers import InvalidAnswer, checked, is_count, is_seconds, shown
from harness.verification.judge import LIMIT_MM
from problems.forms.assembly import Vector
from problems.forms.problem import in_form
from solvers.base import Answer, Form, Status

from .known_problems import KnownCase, KnownProblem

TOLERANCE = 1e-9


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with a solver, where it showed, and how to fix it."""

    form: str
    where: str
    wrong: str
    fix: str

    def __str__(self) -> str:
        return f"[{self.form}] {self.where}: {self.wrong}. {self.fix}."


def inspect(answer: Answer, known: KnownProblem, case: KnownCase, form: Form) -> Iterator[Finding]:
    """What is wrong with the answer to a case at TOLERANCE."""
    where = f"{known.name}, {case.name}"

    def finding(wrong: str, fix: str) -> Finding:
        return Finding(form, where, wrong, fix)

    if not isinstance(answer, Answer):
        yield finding(f"solve returned {type(answer).__name__}", "Return a solvers.base.Answer")
        return
    if not isinstance(answer.status, str) or answer.status not in get_args(Status):
        yield finding(f"status is {shown(answer.status)}", f"Use one of {', '.join(get_args(Status))}")
        if not isinstance(answer.status, str):
            return
    yield from (facts := list(_wrong_facts(answer, finding)))
    yield from (shape_faults := list(_wrong_arrays(answer, known, form, finding)))
    if shape_faults or answer.lam is None:
        return
    try:
        checked(answer, in_form(known.prepared, form))
    except InvalidAnswer as error:
        if not facts and answer.status in get_args(Status):
            yield finding(f"a measurement refuses it: {error}", "Return plain numbers")
    wrong = list(_wrong_values(answer, answer.lam, known, case, finding))
    yield from wrong
    smallest = float(answer.lam.min())
    if not wrong and smallest < -10 * TOLERANCE:
        yield finding(f"λ is as low as {smallest:.3g} N", "Contacts only push: λ ≥ 0 in both forms")


NewFinding = Callable[[str, str], Finding]


def _wrong_facts(answer: Answer, finding: NewFinding) -> Iterator[Finding]:
    for name in ("iterations", "inner_iterations"):
        value = getattr(answer, name)
        if value is not None and not is_count(value):
            yield finding(f"{name} is {shown(value)}", "Give a whole number, or None")
    if answer.reported_s is not None and not is_seconds(answer.reported_s):
        yield finding(f"reported_s is {shown(answer.reported_s)}", "Give seconds as a float, or None")
    try:
        json.dumps(answer.details)
    except Exception as error:  # also of a class of the user's, or too deep
        yield finding(f"details is not JSON ({error})", "Put only numbers, text, lists and dicts there")


def _wrong_arrays(answer: Answer, known: KnownProblem, form: Form, finding: NewFinding) -> Iterator[Finding]:
    n, m = known.prepared.assembly.n, known.prepared.assembly.m
    if answer.lam is None:
        if answer.status == "solved":
            yield finding('status is "solved" but lam is None', "Return λ, or a status that says it failed")
        else:
            yield finding(f'no answer, status "{answer.status}"', "The problem is small and easy: solve it")
        return
    arrays = [("lam", answer.lam, m)]
    if "x" in in_form(known.prepared, form).needs and answer.x is None:
        yield finding("x is None", "Return the displacements; only the dual form may leave them out")
    elif answer.x is not None:
        arrays.append(("x", answer.x, n))
    for name, array, size in arrays:
        if not isinstance(array, np.ndarray) or array.dtype != np.float64:
            kind = getattr(array, "dtype", type(array).__name__)
            yield finding(f"{name} is {kind}", "Return a numpy array of float64")
        elif array.shape != (size,):
            yield finding(
                f"{name} has the shape {array.shape}", f"It must be ({size},): one per {_UNIT[name]}"
            )
        elif not np.isfinite(array).all():
            claim = ', and yet status is "solved"' if answer.status == "solved" else ""
            yield finding(f"{name} has NaN or infinite values{claim}", "Return lam=None and failed instead")


_UNIT = {"lam": "contact (m)", "x": "unknown (n)"}


def _wrong_values(
    answer: Answer, lam: Vector, known: KnownProblem, case: KnownCase, finding: NewFinding
) -> Iterator[Finding]:
    """Compare x with the known displacements, and so K⁻¹(f − Aλ), which follows from λ."""
    load, prepared = case.load, known.prepared
    x_error = 0.0 if answer.x is None else distance(answer.x, case.x)
    lam_error = distance(prepared.recover(lam, load), case.x)
    if x_error > LIMIT_MM:
        yield finding(*_wrong_value("x", answer, x_error))
    if lam_error > LIMIT_MM:
        if distance(prepared.recover(-lam, load), case.x) <= LIMIT_MM:
            fix = "λ ≥ 0 are the multipliers of Aᵀx ≤ g, so Kx − f + Aλ = 0: return −lam"
            yield finding("lam has the wrong sign", fix)
        else:
            yield finding(*_wrong_value("x = K⁻¹(f − A lam)", answer, lam_error))
    if max(x_error, lam_error) <= LIMIT_MM and answer.status in ("failed", "iteration_limit"):
        words = f'status is "{answer.status}" beside a right answer'
        yield finding(words, "Say solved when the tolerance is met")


def _wrong_value(what: str, answer: Answer, error: float) -> tuple[str, str]:
    """The words for a wrong value: what is wrong, and how to fix it."""
    wrong = f"{what} is {error:.2g} mm off (limit {LIMIT_MM:g} mm at tolerance {TOLERANCE:g})"
    meaning = "x solves min ½xᵀKx − fᵀx, Aᵀx ≤ g, in mm; λ solves min ½λᵀQλ − pᵀλ, λ ≥ 0, in N"
    if answer.status == "solved":
        return f'{wrong}, and yet status is "solved"', f"{meaning}; claim solved only at the tolerance"
    return f'{wrong}, status "{answer.status}"', f"{meaning}; raise the iteration limit, say"


def distance(a: Vector, b: Vector) -> float:
    """max |a − b|."""
    return float(np.abs(a - b).max())
