"""Conformance of a solver: small problems with known answers, and plain words for what is wrong."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise

import numpy as np

from harness.measurement.solver_session import SolverSession
from harness.verification.judge import LIMIT_MM
from problems.forms.assembly import Vector
from problems.forms.problem import in_form
from solvers.base import FORMS, Answer, Form, Problem, Solver, WarmStart

from .inspection import TOLERANCE, Finding, distance, inspect
from .trials import Case, Trial, trials

LOOSE = 1e-1  # a tolerance at which an iterative solver must stop earlier than at TOLERANCE


def run(solver_factory: Callable[[], Solver], forms: Sequence[Form] | None = None) -> list[Finding]:
    """Everything that is wrong with the solver in these forms (None: all that it takes)."""
    try:
        taken = solver_factory().forms
    except Exception as error:
        return [_raised("any", "constructor", error)]
    if not taken or any(form not in FORMS for form in taken):
        fix = 'Set it to a tuple of "primal" and "dual", e.g. forms = ("dual",)'
        return [Finding("any", "forms", f"forms is {taken!r}", fix)]
    found: list[Finding] = []
    for form in [form for form in taken if forms is None or form in forms]:
        try:
            for trial in trials():
                found += _check_trial(solver_factory, trial, form)
        except _Raised as raised:
            found.append(raised.finding)
    return _first_of_each(found)


def _check_trial(factory: Callable[[], Solver], trial: Trial, form: Form) -> Iterator[Finding]:
    """The cases one after another on one state, then the first one again, then by a fresh solver."""
    problem = in_form(trial.prepared, form)
    before = _fingerprint(trial)
    first_case, *other_cases = trial.cases
    steps = _Steps(factory(), problem)

    first = steps.answer(first_case)
    wrong = list(inspect(first, trial, first_case, form))
    yield from wrong
    if wrong and _same(first, steps.answer(first_case, LOOSE), trial):
        words = f"wrong, and the same at tolerance {LOOSE:g}: if it iterates, it ignores the tolerance"
        yield Finding(form, trial.name, words, "Hand the argument `tolerance` on to what stops the iteration")

    spoilt = "Let setup and solve change nothing in the prepared state, and start each load case cold"
    for case in other_cases:
        wrong = list(inspect(steps.answer(case), trial, case, form))
        if wrong and not list(inspect(_Steps(factory(), problem).answer(case), trial, case, form)):
            words = f"right on a state of its own, wrong as a second load case ({wrong[0].wrong})"
            yield Finding(form, f"{trial.name}, {case.name}", words, spoilt)
        else:
            yield from wrong
    if wrong_in_series := _in_series(factory, problem, trial):
        words = f"right when each is set up, wrong as a series by `update` ({wrong_in_series})"
        fix = "Let update renew all that depends on the load case; near is a start, not the answer"
        yield Finding(form, trial.name, words, fix)
    if wrong_batched := _batched(factory, problem, trial):
        words = f"right when each is set up, wrong when solved at once by `batched` ({wrong_batched})"
        fix = "An answer to each load, in the order of the loads"
        yield Finding(form, trial.name, words, fix)
    if _differ(first, steps.answer(first_case), trial, first_case):
        words = "the first load case, solved again after others, has another answer"
        yield Finding(form, trial.name, words, spoilt)
    if _differ(first, _Steps(factory(), problem).answer(first_case), trial, first_case):
        words = "not repeatable: two fresh solvers answer the same problem differently"
        yield Finding(
            form, trial.name, words, "Fix the seed of what is random; share nothing between solvers"
        )
    if _fingerprint(trial) != before:
        fix = "Copy K, A, Q, f, g and p before writing into them"
        yield Finding(form, trial.name, "the solver changed the arrays that it was given", fix)


def _in_series(factory: Callable[[], Solver], problem: Problem, trial: Trial) -> str:
    """What is wrong with the cases solved by `update` that are right when each is set up; "" if nothing."""
    steps = _Steps(factory(), problem)
    steps.answer(trial.cases[0])
    for before, case in pairwise(trial.cases):
        wrong = list(inspect(steps.next_answer(case, before), trial, case, problem.form))
        alone = _Steps(factory(), problem).answer(case)
        if wrong and not list(inspect(alone, trial, case, problem.form)):
            return f"{case.name}: {wrong[0].wrong}"
    return ""


def _batched(factory: Callable[[], Solver], problem: Problem, trial: Trial) -> str:
    """What is wrong with the cases solved by `batched` that are right when each is set up; "" if nothing."""
    answers = _Steps(factory(), problem).answers(trial.cases)
    if answers is None:
        return ""
    if len(answers) != len(trial.cases):
        return f"{len(answers)} answers to {len(trial.cases)} load cases"
    for case, answer in zip(trial.cases, answers, strict=True):
        wrong = list(inspect(answer, trial, case, problem.form))
        alone = _Steps(factory(), problem).answer(case)
        if wrong and not list(inspect(alone, trial, case, problem.form)):
            return f"{case.name}: {wrong[0].wrong}"
    return ""


class _Raised(Exception):
    """A step of the solver raised; the finding says what."""

    def __init__(self, finding: Finding) -> None:
        self.finding = finding


class _Steps:
    """A solver taken through its steps as a measurement does; what it raises becomes a finding."""

    def __init__(self, solver: Solver, problem: Problem) -> None:
        self.problem = problem
        self.session = SolverSession(solver, problem, TOLERANCE, self._lap)
        self.session.open(batched=True)

    @contextmanager
    def _lap(self, name: str) -> Iterator[None]:
        try:
            yield
        except Exception as error:
            raise _Raised(_raised(self.problem.form, name.removesuffix("_s"), error)) from error

    def answer(self, case: Case, tolerance: float = TOLERANCE) -> Answer:
        return self.session.cold(case.load, tolerance)

    def next_answer(self, case: Case, before: Case) -> Answer:
        """As a series does, from the answer of the case before."""
        x = before.x if "x" in self.problem.needs else None
        gap = before.load.g - self.problem.assembly.A.T @ before.x
        return self.session.warm(case.load, WarmStart(before.load, before.lam, gap, x))

    def answers(self, cases: Sequence[Case]) -> list[Answer] | None:
        """Those of all cases at once; None where the solver has no such way."""
        if self.session.batch is None:
            return None
        with self._lap("batched"):
            return list(self.session.batch([case.load for case in cases], TOLERANCE))


def _raised(form: str, step: str, error: Exception) -> Finding:
    last = traceback.extract_tb(error.__traceback__)[-1]
    words = f"raised {type(error).__name__}: {error} ({last.filename}, line {last.lineno})"
    if "read-only" in str(error):
        return Finding(form, step, words, "The problem's arrays are shared and read-only: copy, then write")
    return Finding(form, step, words, "A solver that cannot go on returns Answer('failed', None)")


def _lam(answer: object, trial: Trial) -> Vector | None:
    """λ if there is one that can be compared; anything else has been reported as what it is."""
    lam = getattr(answer, "lam", None)
    if not isinstance(lam, np.ndarray) or lam.shape != (trial.prepared.assembly.m,):
        return None
    return lam if np.isfinite(lam).all() else None


def _same(one: Answer, two: Answer, trial: Trial) -> bool:
    a, b = _lam(one, trial), _lam(two, trial)
    return a is not None and b is not None and np.array_equal(a, b)


def _differ(one: Answer, two: Answer, trial: Trial, case: Case) -> bool:
    """Whether the displacements of two answers differ by more than a hundredth of the limit."""
    a, b = _lam(one, trial), _lam(two, trial)
    if a is None or b is None:
        return False
    recover = trial.prepared.recover
    return distance(recover(a, case.load), recover(b, case.load)) > LIMIT_MM / 100


def _fingerprint(trial: Trial) -> list[bytes]:
    assembly = trial.prepared.assembly
    loads = [array for case in trial.cases for array in (case.load.f, case.load.g, case.load.p)]
    matrices = [*assembly.blocks, *trial.prepared.factors, trial.prepared.Q]
    return [a.tobytes() for a in (*matrices, assembly.A.data, assembly.A.indices, *loads)]


def _first_of_each(found: list[Finding]) -> list[Finding]:
    """The first finding of each kind in each form, for one fault shows in many cases."""
    kinds: dict[tuple[str, str], Finding] = {}
    for finding in found:
        kinds.setdefault((finding.form, finding.fix), finding)
    return list(kinds.values())
