"""Contacts in any units: the solvers of this project are right, or do not say solved."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from small import make_load, make_prepared, solve_by_nnls
from solving import IN_HOUSE, TOLERANCES

from harness.solving.session import SolverSession
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from solvers.base import Form, WarmStart
from solvers.registry import make_solver
from solvers.scaling import Scaled, contact_units


def rescaled(seed: int, bits: int) -> tuple[Prepared, LoadCase, np.ndarray, np.ndarray, np.ndarray]:
    """A joint with columns of A and gaps times 2^−bits … 2^bits; its x, λ, and those factors."""
    given = make_prepared(seed, 15, 4)
    case, _ = make_load(seed + 1, given)
    x, lam = solve_by_nnls(given, case)
    c = np.exp2(np.random.default_rng(seed).integers(-bits, bits + 1, given.assembly.m))
    A = sp.csc_array(given.assembly.A @ sp.diags_array(c))
    return Prepared(Assembly(given.assembly.K, A)), LoadCase(case.f, case.g * c), x, lam / c, c


@pytest.mark.parametrize(("name", "form"), IN_HOUSE)
@pytest.mark.parametrize("bits", [3, 40])
@pytest.mark.parametrize("seed", range(6))
def test_answers_do_not_depend_on_the_units_of_contacts(name: str, form: Form, bits: int, seed: int) -> None:
    """Without the scaling, ipm-fast and ipm called answers solved that were 100 mm off."""
    prepared, case, x, lam, c = rescaled(seed, bits)
    problem = in_form(prepared, form)
    session = SolverSession(make_solver(name, {}), problem, TOLERANCES[name])
    session.open(batched=True)
    (load,) = problem.loads([case])
    again = LoadCase(case.f, case.g + 0.01 * c)
    (other,) = problem.loads([again])
    answers = [session.next(load, None), session.next(load, session.nearest(other))]
    if session.batch is not None:
        answers += session.solve_batch([load, load])
    for answer in answers:
        assert answer.status == "solved"
        (found,) = problem.recover([answer.lam], [answer.x], [case])
        np.testing.assert_allclose(found, x, rtol=0, atol=1e-8)
        np.testing.assert_allclose(answer.lam * c, lam * c, rtol=0, atol=1e-4)


def test_a_problem_in_mm_is_handed_on_as_it_is() -> None:
    prepared = make_prepared(1, 8)
    case, _ = make_load(2, prepared)
    problem = in_form(prepared, "dual")
    (load,) = problem.loads([case])
    solver = make_solver("newton", {})
    assert isinstance(solver, Scaled)
    converted = solver.convert(problem)
    assert converted.inner is problem
    assert converted.load(load) is load


def test_units_are_powers_of_two_that_normalise_the_columns() -> None:
    A = sp.csc_array(np.array([[3.0, 0.0, 1.0], [-3.0, 2.0**-40, 0.0]]))
    np.testing.assert_array_equal(contact_units(A), [4.0, 2.0**-40, 1.0])


def test_a_warm_start_is_scaled_with_the_problem() -> None:
    prepared, case, _, lam, c = rescaled(3, 20)
    problem = in_form(prepared, "dual")
    (load,) = problem.loads([case])
    solver = make_solver("newton", {})
    state = solver.prepare(solver.convert(problem))
    start = WarmStart(load, lam, problem.gap(load, lam, None))
    ready = solver.update(state, solver.setup(state, load, 1e-10), load, 1e-10, start)
    answer = solver.solve(ready, load, 1e-10)
    assert answer.iterations == 1  # the set is the solution's
    np.testing.assert_allclose(answer.lam * c, lam * c, rtol=1e-6, atol=1e-6)
