"""What is wrong with one answer to a problem whose answer is known, in plain words."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from harness.solving.answers import examined
from harness.verification.judge import LIMIT_MM
from problems.forms.assembly import Vector
from problems.forms.problem import in_form
from solvers.base import Answer, Form

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
    where, problem = f"{known.name}, {case.name}", in_form(known.prepared, form)

    def finding(wrong: str, fix: str) -> Finding:
        return Finding(form, where, wrong, fix)

    plain, faults = examined(answer, problem)
    for fault in faults:
        yield finding(str(fault), fault.fix)
    if not isinstance(answer, Answer):
        return
    for name in problem.needs:
        if getattr(answer, name) is None:
            fix = "The problem is small and easy: return λ, and x in all forms but the dual"
            yield finding(f'{name} is None, status "{plain.status}"', fix)
    for name in ("lam", "x"):
        given = getattr(answer, name)
        if getattr(plain, name) is not None and getattr(given, "dtype", None) != np.float64:
            kind = getattr(given, "dtype", type(given).__name__)
            yield finding(f"{name} is {kind}", f"Return {name} in double precision: a numpy array of float64")
    if plain.lam is None:
        return
    wrong = list(_wrong_values(plain, plain.lam, known, case, finding))
    yield from wrong
    smallest = float(plain.lam.min())
    if not wrong and smallest < -10 * TOLERANCE:
        yield finding(f"λ is as low as {smallest:.3g} N", "Contacts only push: λ ≥ 0 in both forms")


def _wrong_values(
    answer: Answer, lam: Vector, known: KnownProblem, case: KnownCase, finding: Callable[[str, str], Finding]
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
