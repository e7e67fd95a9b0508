"""Checks a solver on small problems with known answers; each fault is a finding in plain words."""

import math
import sysconfig
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from harness.solving.solver_answer import InvalidAnswer, checked, error_text, examined, shown
from harness.solving.solver_session import OTHER_NAME, SolverSession, given_arrays, replaced
from harness.verification.judge import LIMIT_MM
from problems import ROOT
from problems.errors import InputError, refuse_text
from problems.forms.assembly import Vector
from problems.forms.problem import in_form
from problems.reporter import Reporter
from solvers.base import FORMS, Answer, Form, Problem, Solver, WarmStart

from .known_problems import KnownCase, KnownProblem, known_problems

TOLERANCE = 1e-9
LOOSE = 1e-1  # a tolerance at which an iterative solver stops earlier than at TOLERANCE
MEANING = "x solves min ½xᵀKx − fᵀx, Aᵀx ≤ g, in mm; λ solves min ½λᵀQλ − pᵀλ, λ ≥ 0, in N"
NO_ANSWER = "The problem is small and easy: return λ, and x in all forms but the dual"


@dataclass(frozen=True)
class Finding:
    """One fault of a solver: the form and the problem where it showed, what is wrong, and how to fix it."""

    form: str
    where: str
    wrong: str
    fix: str

    def __str__(self) -> str:
        return f"[{self.form}] {self.where}: {self.wrong}. {self.fix}."


def run(solver_factory: Callable[[], Solver], forms: Sequence[Form] = FORMS) -> list[Finding]:
    """Test a solver on small problems with known answers, in this process.

    Parameters
    ----------
    solver_factory : callable
        Makes a solver: its class, or a function without arguments.
    forms : sequence of str, optional
        The forms to test, of those that it takes: "primal", "dual", "sparse".

    Returns
    -------
    list of Finding
        All that is wrong, each with a way to fix it; empty for a sound solver.

    Raises
    ------
    InputError
        If `forms` is a text, or names what is no form.
    SystemExit
        If the solver ends the process.

    Notes
    -----
    The command `check` also finds a solver that hangs or ends its process.

    Examples
    --------
    >>> from rivetbench import check_solver
    >>> from solvers.methods.newton import ActiveSetNewton
    >>> check_solver(ActiveSetNewton, ("dual",))
    []
    """
    refuse_text("check_solver", forms=forms)
    if unknown := [form for form in forms if form not in FORMS]:
        raise InputError.one("check_solver", "forms", unknown, f"some of {', '.join(FORMS)}")
    return first_of_each(findings(solver_factory, forms))


def first_of_each(all_findings: Iterable[Finding]) -> list[Finding]:
    """The first finding of each kind in each form: one fault shows in many cases."""
    kinds: dict[tuple[str, str], Finding] = {}
    for finding in all_findings:
        kinds.setdefault((finding.form, finding.fix), finding)
    return list(kinds.values())


def findings(
    factory: Callable[[], Solver],
    forms: Sequence[Form] = FORMS,
    begin: Callable[[Form, str], None] = lambda form, problem: None,
) -> Iterator[Finding]:
    """Each fault as soon as it shows. begin : called with the form and the name of each problem before it."""
    try:
        made = factory()
        taken, own = made.forms, {name: shown(getattr(made, name)) for name in replaced(made)}
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        yield _raised("any", "constructor", error)
        return
    if not isinstance(taken, tuple | list) or not taken or any(form not in FORMS for form in taken):
        fix = 'Set it to a tuple of "primal", "dual" and "sparse", e.g. forms = ("dual",)'
        yield Finding("any", "forms", f"forms is {shown(taken)}", fix)
        return
    for name, value in own.items():
        yield Finding("any", name, f"{name} is {value}", OTHER_NAME)
    for form in [form for form in taken if form in forms]:
        try:
            for trial in known_problems(form):
                begin(form, trial.name)
                yield from _check_problem(factory, trial, form)
        except _Raised as raised:
            yield raised.finding


def _check_problem(factory: Callable[[], Solver], trial: KnownProblem, form: Form) -> Iterator[Finding]:
    """Check each case with a solver of its own; then all with one solver, in each way to solve several."""
    problem = in_form(trial.prepared, form)
    given = given_arrays(problem, *(case.load for case in trial.cases))

    def alone(case: KnownCase, tolerance: float = TOLERANCE) -> Answer:
        return _Steps(factory(), problem, tolerance).answer(case)

    answers = [alone(case) for case in trial.cases]
    wrong = [inspect(answer, trial, case, form) for case, answer in zip(trial.cases, answers, strict=True)]
    yield from filter(None, wrong)
    first, answer = trial.cases[0], answers[0]
    if wrong[0] and _apart(answer, alone(first, LOOSE), trial, first) == 0.0:
        what = f"wrong, and the same at tolerance {LOOSE:g}: if it iterates, it ignores the tolerance"
        yield Finding(form, trial.name, what, "Use the argument `tolerance` in the stopping test")
    if not wrong[0] and _apart(answer, alone(first), trial, first) > LIMIT_MM / 100:
        what = "not repeatable: two fresh solvers answer the same problem differently"
        yield Finding(form, trial.name, what, "Fix random seeds; share nothing between solvers")
    for way, (what, fix) in WAYS.items():
        some = way(_Steps(factory(), problem), trial.cases)
        for k, (case, answer) in enumerate(zip(trial.cases, some, strict=bool(some))):
            if not wrong[k] and (fault := inspect(answer, trial, case, form)):
                words = f"right when solved alone, wrong {what} ({case.name}: {fault.wrong})"
                yield Finding(form, trial.name, words, fix)
                break
    try:
        given.check()
    except InvalidAnswer as fault:
        yield Finding(form, trial.name, str(fault), "K, A, Q, f, g and p are shared")


def inspect(answer: Answer, trial: KnownProblem, case: KnownCase, form: Form) -> Finding | None:
    """The first fault of the answer to a case at TOLERANCE; None if there is none."""

    def finding(wrong: str, fix: str) -> Finding:
        return Finding(form, f"{trial.name}, {case.name}", wrong, fix)

    prepared, load, problem = trial.prepared, case.load, in_form(trial.prepared, form)
    try:
        plain = checked(answer, problem)
    except InvalidAnswer as fault:
        return finding(str(fault), fault.fix or NO_ANSWER)
    if missing := [name for name in problem.needs if getattr(plain, name) is None]:
        return finding(f'{missing[0]} is None, status "{plain.status}"', NO_ANSWER)
    assert plain.lam is not None
    errors = {} if plain.x is None else {"x": _largest(plain.x - case.x)}
    errors["x = K⁻¹(f − A lam)"] = _largest(prepared.recover(plain.lam, load) - case.x)
    for what, error in errors.items():
        if error <= LIMIT_MM:
            continue
        if _largest(prepared.recover(-plain.lam, load) - case.x) <= LIMIT_MM:
            fix = "λ ≥ 0 are the multipliers of Aᵀx ≤ g, so Kx − f + Aλ = 0: return −lam"
            return finding("lam has the wrong sign", fix)
        wrong = f"{what} is {error:.2g} mm off (limit {LIMIT_MM:g} mm at tolerance {TOLERANCE:g})"
        if plain.status == "solved":
            fix = f"{MEANING}; claim solved only at the tolerance"
            return finding(f'{wrong}, and yet status is "solved"', fix)
        return finding(f'{wrong}, status "{plain.status}"', f"{MEANING}; raise the iteration limit, say")
    if plain.status in ("failed", "iteration_limit"):
        words = f'status is "{plain.status}" beside a right answer'
        return finding(words, "Say solved when the tolerance is met")
    if (smallest := float(plain.lam.min())) < -10 * TOLERANCE:
        return finding(f"λ is as low as {smallest:.3g} N", "Contacts only push: λ ≥ 0 in every form")
    return None


class _Raised(Exception):
    """A step of the solver raised; the finding says what."""

    def __init__(self, finding: Finding) -> None:
        self.finding = finding


class _Steps(Reporter):
    """A solver taken through its steps as in a measurement; an exception becomes a finding."""

    def __init__(self, solver: Solver, problem: Problem, tolerance: float = TOLERANCE) -> None:
        self.problem = problem
        self.session = SolverSession(solver, problem, tolerance, self)
        self.session.open(batched=True)

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        try:
            yield
        except (Exception, SystemExit) as error:
            raise _Raised(_raised(self.problem.form, name.removesuffix("_s"), error)) from error

    def answer(self, case: KnownCase) -> Answer:
        return self.session.cold(case.load)

    def one_by_one(self, cases: Sequence[KnownCase]) -> list[Answer]:
        return [self.answer(case) for case in cases]

    def as_series(self, cases: Sequence[KnownCase]) -> list[Answer]:
        """Start each but the first from the known answer of the case before."""
        answers = [self.answer(cases[0])]
        for last, case in pairwise(cases):
            x = last.x if "x" in self.problem.needs else None
            gap = last.load.g - self.problem.assembly.A.T @ last.x
            answers.append(self.session.warm(case.load, WarmStart(last.load, last.lam, gap, x)))
        return answers

    def at_once(self, cases: Sequence[KnownCase]) -> list[Answer]:
        """Solve all cases in one call; no answers if the solver cannot."""
        if self.session.batch is None:
            return []
        with self.step("batched"):
            return self.session.solve_batch([case.load for case in cases])


#: Ways to solve several cases, each with the words of a finding and its fix if only this way goes wrong.
WAYS = {
    _Steps.one_by_one: (
        "as a second load case",
        "Let setup and solve not change the prepared state, and start each load case cold",
    ),
    _Steps.as_series: (
        "as a series by `update`",
        "Let update renew all that depends on the load case; the warm start is not the answer",
    ),
    _Steps.at_once: (
        "when solved at once by `batched`",
        "Return an answer to each load, in the order of the loads",
    ),
}


def _raised(form: str, step: str, error: BaseException) -> Finding:
    place = _place(error)
    what = f"raised {error_text(error)} ({place.filename}, line {place.lineno})"
    if "read-only" in what:
        return Finding(form, step, what, "The problem's arrays are shared and read-only: copy, then write")
    return Finding(form, step, what, "A solver that cannot go on returns Answer('failed', None)")


def _place(error: BaseException) -> traceback.FrameSummary:
    """The deepest line of the solver's author, who reads it, not that of a library which was called there."""
    frames = [*traceback.extract_tb(error.__traceback__)]
    called = [frame for frame in frames if ROOT / "harness" not in Path(frame.filename).parents]
    own = [frame for frame in called if not _is_installed(Path(frame.filename))]
    return (own or called[:1] or frames)[-1]


def _is_installed(file: Path) -> bool:
    """Whether a file is of an installed package or of the standard library."""
    installed = {"site-packages", "dist-packages"} & {*file.parts}
    return bool(installed) or Path(sysconfig.get_path("stdlib")) in file.parents


def _apart(one: Answer, other: Answer, trial: KnownProblem, case: KnownCase) -> float:
    """max|x − x'| of the displacements that follow from the forces of two answers, mm; NaN without forces."""
    x = []
    for answer in (one, other):
        plain, _ = examined(answer, in_form(trial.prepared, "dual"))
        if plain.lam is None:
            return math.nan
        x.append(trial.prepared.recover(plain.lam, case.load))
    return _largest(x[0] - x[1])


def _largest(difference: Vector) -> float:
    return float(np.abs(difference).max())
