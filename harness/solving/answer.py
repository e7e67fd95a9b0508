"""One load case by one solver, from its set-up to displacements; and by the in-house methods in turn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from problems.errors import InputError
from problems.forms.assembly import LoadCase, Vector
from problems.forms.names import Form, default_form
from problems.forms.prepared import Prepared
from problems.forms.problem import Problem, in_form
from solvers.base import Answer, Solver

from .answers import InvalidAnswer
from .session import SolverSession

NO_ANSWER = "gave no answer; try another solver or form"
NO_CONTACT = "no contact closes"
#: The methods that a reference may be proven from.
DENSE = ("newton", "ipm-fast", "ipm", "gi")
SPARSE = ("newton", "mprgp")
TOLERANCE_MM = 1e-11  # of these


def form_of(name: str, taken: Sequence[Form], form: Form | None = None) -> Form:
    """The form asked for, else the usual one of those that a solver takes. Raises InputError."""
    form = form or default_form(taken)
    if form not in taken:
        raise InputError.one(f"solver {name}", "form", form, f"it takes {' and '.join(taken)}")
    return form


def answer_of(
    name: str, solver: Solver, data: Prepared, form: Form, case: LoadCase, tolerance: float
) -> Answer:
    """The solver's answer with x (n,) in mm, recovered where the form has none.

    lam is None if the solver gives no forces. Raises InputError if there are no displacements.
    """
    problem = in_form(data, form)
    answer = forces_of(name, solver, problem, case, tolerance)
    (x,) = problem.recover([answer.lam], [answer.x], [case])
    if x is None:
        raise no_answer(name, answer)
    return replace(answer, x=x)


def forces_of(name: str, solver: Solver, problem: Problem, case: LoadCase, tolerance: float) -> Answer:
    """The solver's own answer. Raises InputError if it is invalid, or neither forces nor displacements."""
    session = SolverSession(solver, problem, tolerance)
    session.open()
    (load,) = problem.loads([case])
    try:
        answer = session.next(load, None)
    except InvalidAnswer as error:
        raise InputError.one(f"solver {name}", "answer", str(error), NO_ANSWER) from error
    if answer.lam is None and answer.x is None:
        raise no_answer(name, answer)
    return answer


def no_answer(name: str, answer: Answer) -> InputError:
    """The error of a solver that gives neither forces nor displacements."""
    said = f"{answer.status}: {answer.details['cause']}" if "cause" in answer.details else answer.status
    return InputError.one(f"solver {name}", "status", said, NO_ANSWER)


def candidates(prepared: Prepared, load: LoadCase) -> Iterator[tuple[str, Vector]]:
    """Names and λ (m,) N of the in-house methods; each is run when its answer is asked for.

    None is run where no contact overlaps.
    """
    if not (prepared.dual_load(load) > 0).any():
        yield NO_CONTACT, np.zeros(prepared.assembly.m)
        return
    from solvers.registry import make_solver  # slow to import

    problem = in_form(prepared, prepared.form)
    for name in SPARSE if prepared.form == "sparse" else DENSE:
        try:
            answer = forces_of(name, make_solver(name, {}), problem, load, TOLERANCE_MM)
        except (InputError, ArithmeticError, np.linalg.LinAlgError, RuntimeError):
            continue  # it gave no answer
        if answer.lam is not None:
            yield f"{name}, refined", answer.lam
