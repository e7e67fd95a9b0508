"""The textbook's active set: the sets it goes through and warm starts."""

import numpy as np
from small import make_load, make_strips, solve_by_nnls

from problems.forms.problem import in_form
from solvers.base import Answer, WarmStart
from solvers.registry import make_solver

PREPARED = make_strips(60)
CASE, LOAD = make_load(3, PREPARED)


def solved(start: WarmStart | None = None) -> Answer:
    solver = make_solver("textbook-active-set", {})
    state = solver.prepare(solver.convert(in_form(PREPARED, "dual")))
    ready = state if start is None else solver.update(state, state, LOAD, 1e-10, start)
    return solver.solve(ready, LOAD, 1e-10)


def test_it_ends_with_the_closed_contacts_of_the_answer() -> None:
    answer = solved()
    _, lam = solve_by_nnls(PREPARED, CASE)
    assert answer.status == "solved"
    assert ((answer.lam > 0) == (lam > 0)).all()
    assert answer.iterations > 1


def test_from_the_answer_it_needs_one_set_and_from_no_contact_it_finds_it() -> None:
    lam = solved().lam
    assert solved(WarmStart(LOAD, lam, PREPARED.Q @ lam - LOAD.p)).iterations == 1
    nothing = np.zeros_like(LOAD.p)
    assert np.allclose(solved(WarmStart(LOAD, nothing, -LOAD.p)).lam, lam)
