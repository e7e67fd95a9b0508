"""Conformance of a solver: small problems with known answers, findings in plain words."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise

from harness.solving.answers import InvalidAnswer, error_text, shown, vector
from harness.solving.session import SolverSession
from harness.verification.judge import LIMIT_MM
from problems.forms.assembly import Vector
from problems.forms.problem import in_form
from solvers.base import FORMS, Answer, Form, Problem, Solver, WarmStart

from .inspection import TOLERANCE, Finding, distance, inspect
from .known_problems import KnownCase, KnownProblem, arrays_of, known_problems

LOOSE = 1e-1  # a tolerance at which an iterative solver stops earlier than at TOLERANCE


def run(solver_factory: Callable[[], Solver], forms: Sequence[Form] | None = None) -> list[Finding]:
    """All that is wrong with the solver in these forms (None: all that it takes), in this process.

    A solver that ends the process or hangs is for isolated.py.
    """
    return first_of_each(findings(solver_factory, forms))


def findings(
    factory: Callable[[], Solver],
    forms: Sequence[Form] | None = None,
    begin: Callable[[str], None] = lambda test: None,
) -> Iterator[Finding]:
    """All that is wrong, as it is found. begin : called with each form and problem before its test."""
    try:
        taken = factory().forms
    except (Exception, SystemExit) as error:
        yield _raised("any", "constructor", error)
        return
    if not isinstance(taken, tuple | list) or not taken or any(form not in FORMS for form in taken):
        fix = 'Set it to a tuple of "primal", "dual" and "sparse", e.g. forms = ("dual",)'
        yield Finding("any", "forms", f"forms is {shown(taken)}", fix)
        return
    for form in [form for form in taken if forms is None or form in forms]:
        try:
            for known in known_problems(form):
                begin(f"{form}, {known.name}")
                yield from _check_problem(factory, known, form)
        except _Raised as raised:
            yield raised.finding


def _check_problem(factory: Callable[[], Solver], known: KnownProblem, form: Form) -> Iterator[Finding]:
    """The cases one after another on one state, then the first one again, then by a fresh solver."""
    problem = in_form(known.prepared, form)
    before = _fingerprint(known)
    first_case, *other_cases = known.cases
    steps = _Steps(factory(), problem)

    first = steps.answer(first_case)
    wrong = list(inspect(first, known, first_case, form))
    yield from wrong
    if wrong and _same(first, steps.answer(first_case, LOOSE), known):
        what = f"wrong, and the same at tolerance {LOOSE:g}: if it iterates, it ignores the tolerance"
        yield Finding(form, known.name, what, "Use the argument `tolerance` in the stopping test")

    state_fix = "Let setup and solve not change the prepared state, and start each load case cold"
    for case in other_cases:
        wrong = list(inspect(steps.answer(case), known, case, form))
        if wrong and not list(inspect(_Steps(factory(), problem).answer(case), known, case, form)):
            what = f"right on a state of its own, wrong as a second load case ({wrong[0].wrong})"
            yield Finding(form, f"{known.name}, {case.name}", what, state_fix)
        else:
            yield from wrong
    if wrong_in_series := _wrong_in_series(factory, problem, known):
        what = f"right when each is set up, wrong as a series by `update` ({wrong_in_series})"
        fix = "Let update renew all that depends on the load case; the warm start is not the answer"
        yield Finding(form, known.name, what, fix)
    if wrong_batched := _wrong_batched(factory, problem, known):
        what = f"right when each is set up, wrong when solved at once by `batched` ({wrong_batched})"
        fix = "Return an answer to each load, in the order of the loads"
        yield Finding(form, known.name, what, fix)
    if _differ(first, steps.answer(first_case), known, first_case):
        what = "the first load case, solved again after others, has a different answer"
        yield Finding(form, known.name, what, state_fix)
    if _differ(first, _Steps(factory(), problem).answer(first_case), known, first_case):
        what = "not repeatable: two fresh solvers answer the same problem differently"
        yield Finding(form, known.name, what, "Fix random seeds; share nothing between solvers")
    if _fingerprint(known) != before:
        fix = "Copy K, A, Q, f, g and p before writing into them"
        yield Finding(form, known.name, "the solver changed the arrays that it was given", fix)


def _wrong_in_series(factory: Callable[[], Solver], problem: Problem, known: KnownProblem) -> str:
    """What is wrong in cases solved by `update` but right when set up each; "" if nothing."""
    steps = _Steps(factory(), problem)
    steps.answer(known.cases[0])
    pairs = ((case, steps.next_answer(case, before)) for before, case in pairwise(known.cases))
    return _first_wrong(pairs, factory, problem, known)


def _wrong_batched(factory: Callable[[], Solver], problem: Problem, known: KnownProblem) -> str:
    """What is wrong in cases solved by `batched` but right when set up each; "" if nothing."""
    answers = _Steps(factory(), problem).answers(known.cases)
    if answers is None:
        return ""
    if len(answers) != len(known.cases):
        return f"{len(answers)} answers to {len(known.cases)} load cases"
    return _first_wrong(zip(known.cases, answers, strict=True), factory, problem, known)


def _first_wrong(
    answers: Iterable[tuple[KnownCase, Answer]],
    factory: Callable[[], Solver],
    problem: Problem,
    known: KnownProblem,
) -> str:
    """The first answer that is wrong although a fresh solver's is right; "" if there is none."""
    for case, answer in answers:
        wrong = list(inspect(answer, known, case, problem.form))
        if wrong and not list(inspect(_Steps(factory(), problem).answer(case), known, case, problem.form)):
            return f"{case.name}: {wrong[0].wrong}"
    return ""


class _Raised(Exception):
    """A step of the solver raised; the finding says what."""

    def __init__(self, finding: Finding) -> None:
        self.finding = finding


class _Steps:
    """A solver taken through its steps as in a measurement; an exception becomes a finding."""

    def __init__(self, solver: Solver, problem: Problem) -> None:
        self.problem = problem
        self.session = SolverSession(solver, problem, TOLERANCE, self._lap)
        self.session.open(batched=True)

    @contextmanager
    def _lap(self, name: str) -> Iterator[None]:
        try:
            yield
        except (Exception, SystemExit) as error:
            raise _Raised(_raised(self.problem.form, name.removesuffix("_s"), error)) from error

    def answer(self, case: KnownCase, tolerance: float = TOLERANCE) -> Answer:
        return self.session.cold(case.load, tolerance)

    def next_answer(self, case: KnownCase, before: KnownCase) -> Answer:
        """From the answer of the case before, as in a series."""
        x = before.x if "x" in self.problem.needs else None
        gap = before.load.g - self.problem.assembly.A.T @ before.x
        return self.session.warm(case.load, WarmStart(before.load, before.lam, gap, x))

    def answers(self, cases: Sequence[KnownCase]) -> list[Answer] | None:
        """The answers to all cases at once; None if the solver cannot."""
        if self.session.batch is None:
            return None
        with self._lap("batched"), self.session.in_one_process():
            return list(self.session.batch([case.load for case in cases], TOLERANCE))


def _raised(form: str, step: str, error: BaseException) -> Finding:
    last = traceback.extract_tb(error.__traceback__)[-1]
    what = f"raised {error_text(error)} ({last.filename}, line {last.lineno})"
    if "read-only" in what:
        return Finding(form, step, what, "The problem's arrays are shared and read-only: copy, then write")
    return Finding(form, step, what, "A solver that cannot go on returns Answer('failed', None)")


def _lam(answer: object, known: KnownProblem) -> Vector | None:
    """λ if it can be compared; anything else has been reported already."""
    try:
        return vector("lam", getattr(answer, "lam", None), known.prepared.assembly.m)
    except InvalidAnswer:
        return None


def _same(one: Answer, two: Answer, known: KnownProblem) -> bool:
    a, b = _lam(one, known), _lam(two, known)
    return a is not None and b is not None and bool((a == b).all())


def _differ(one: Answer, two: Answer, known: KnownProblem, case: KnownCase) -> bool:
    """Whether the displacements of two answers differ by more than a hundredth of the limit."""
    a, b = _lam(one, known), _lam(two, known)
    if a is None or b is None:
        return False
    recover = known.prepared.recover
    return distance(recover(a, case.load), recover(b, case.load)) > LIMIT_MM / 100


def _fingerprint(known: KnownProblem) -> list[bytes]:
    loads = [array for case in known.cases for array in (case.load.f, case.load.g, case.load.p)]
    return [array.tobytes() for array in (*arrays_of(known.prepared), *loads)]


def first_of_each(found: Iterable[Finding]) -> list[Finding]:
    """The first finding of each kind in each form: one fault shows in many cases."""
    kinds: dict[tuple[str, str], Finding] = {}
    for finding in found:
        kinds.setdefault((finding.form, finding.fix), finding)
    return list(kinds.values())
