"""Series of load cases: each solver's `update` in the place of `setup`, from a near answer."""

from typing import Any

import numpy as np
import pytest
from small import make_load, make_prepared, solve_by_nnls

from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from solvers.base import FORMS, Form, Solver, WarmStart
from solvers.registry import make_solver, modules

VARIANTS: list[tuple[str, dict[str, Any]]] = [
    *((name, {}) for name in modules()),
    ("piqp", {"backend": "sparse"}),
]
CASES = [(name, options, form) for name, options in VARIANTS for form in make_solver(name, options).forms]
TOLERANCE = 1e-9
BALANCED_TOLERANCE = 1e-10  # where loads and gaps are a hundredth in size
#: 1e-8 of others. L-BFGS-B leaves what does not change the objective's last digit.
ALLOWED_MM = {"l-bfgs-b": 1e-7, "cvxpy": 1e-7}


def near_of(prepared: Prepared, case: LoadCase, form: Form) -> WarmStart:
    x, lam = solve_by_nnls(prepared, case)
    load = LoadCase(case.f, case.g, prepared.dual_load(case))
    return WarmStart(load, lam, case.g - prepared.assembly.A.T @ x, x if form != "dual" else None)


def started(name: str, options: dict[str, Any], prepared: Prepared, form: Form) -> tuple[Solver, Any]:
    solver = make_solver(name, options)
    return solver, solver.prepare(solver.convert(in_form(prepared, form)))


@pytest.mark.parametrize(("name", "options", "form"), CASES, ids=str)
def test_a_series_agrees_with_nnls(name: str, options: dict[str, Any], form: Form) -> None:
    """Other forces, other gaps, both; each from an answer that is not the last one's."""
    prepared = make_prepared(2, 20, 5)
    tolerance = BALANCED_TOLERANCE if form == "sparse" else TOLERANCE
    solver, state = started(name, options, prepared, form)
    first, load = make_load(3, prepared)
    ready = solver.setup(state, load, tolerance)
    solver.solve(ready, load, tolerance)
    nears = [near_of(prepared, first, form)]
    rng = np.random.default_rng(0)
    for k in range(5):
        g = first.g + rng.uniform(0, 0.1, len(first.g)) if k != 1 else first.g
        case = LoadCase(first.f * (1 + 0.1 * k), g)
        load = LoadCase(case.f, case.g, prepared.dual_load(case))
        ready = solver.update(state, ready, load, tolerance, nears[max(len(nears) - 2, 0)])
        got = solver.solve(ready, load, tolerance)
        x, lam = solve_by_nnls(prepared, case)
        assert got.status == "solved" or name == "l-bfgs-b"
        found = got.x if form != "dual" else prepared.recover(got.lam, case)
        np.testing.assert_allclose(found, x, rtol=0, atol=ALLOWED_MM.get(name, 1e-8))
        np.testing.assert_allclose(got.lam, lam, rtol=0, atol=1e-3)
        nears.append(near_of(prepared, case, form))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", ["osqp", "proxqp"])
def test_a_warm_start_is_taken(name: str, form: Form) -> None:
    """From its own answer a case takes fewer iterations than from the answer of another."""
    prepared = make_prepared(4, 30, 5)
    case, load = make_load(5, prepared)
    other = make_load(6, prepared)[0]
    taken = {}
    for near in (case, other):
        solver, state = started(name, {}, prepared, form)
        before = LoadCase(near.f, near.g, prepared.dual_load(near))
        ready = solver.setup(state, before, TOLERANCE)
        solver.solve(ready, before, TOLERANCE)
        ready = solver.update(state, ready, load, TOLERANCE, near_of(prepared, near, form))
        answer = solver.solve(ready, load, TOLERANCE)
        taken[id(near)] = answer.inner_iterations or answer.iterations
    assert taken[id(case)] < taken[id(other)]
