"""The fast interior-point method: its systems in single precision, and its answers with each ingredient."""

import numpy as np
import pytest
from small import make_load, make_prepared, solve_by_nnls
from test_gi import definite

from problems.errors import InputError
from problems.forms.problem import in_form
from solvers.interior_point.single_precision import SinglePrecision
from solvers.methods.ipm_fast import FastIpm


@pytest.mark.parametrize("tolerance", [1e-2, 1e-5, 1e-9])
@pytest.mark.parametrize("condition", [1e1, 1e5])
def test_a_single_factor_is_refined_to_any_tolerance(condition: float, tolerance: float) -> None:
    rng = np.random.default_rng(0)
    Q = definite(40, 1, condition) * np.outer(s := 10 ** rng.uniform(-1, 1, 40), s)
    system = SinglePrecision(Q)
    for _ in range(3):
        D, b = np.diag(Q) * 10 ** rng.uniform(-6, 2, 40), rng.standard_normal(40)
        solved = system.solve(D, b, tolerance, 100)
        assert solved.converged
        assert system.use_single
        assert np.linalg.norm(b - Q @ solved.v - D * solved.v) <= 1.01 * tolerance * np.linalg.norm(b)
    assert system.factorisations == 3


def test_one_factor_serves_all_right_hand_sides_of_a_matrix() -> None:
    Q, D = definite(30, 2), np.ones(30)
    system = SinglePrecision(Q)
    for seed in range(4):
        system.solve(D, np.random.default_rng(seed).standard_normal(30), 1e-3, 100)
    assert system.factorisations == 1


def test_what_single_precision_cannot_factor_is_factored_in_double() -> None:
    Q = definite(40, 3, condition=1e11)
    system, b = SinglePrecision(Q), np.ones(40)
    D = np.full(40, 1e-13 * abs(Q).max())
    solved = system.solve(D, b, 1e-6, 100)
    assert not system.use_single
    assert np.linalg.norm(b - Q @ solved.v - D * solved.v) <= 1e-4 * np.linalg.norm(b)
    system.begin()
    assert system.use_single
    assert system.factorisations == 0


@pytest.mark.parametrize("options", [{}, {"finish": False}, {"single": False}, {"start_at_gaps": False}])
@pytest.mark.parametrize("seed", range(3))
def test_answers_against_nnls(seed: int, options: dict[str, bool]) -> None:
    prepared = make_prepared(seed, 5 + 6 * seed, tools=seed % 3)
    case, load = make_load(seed, prepared)
    solver = FastIpm(**options)
    answer = solver.solve(solver.prepare(in_form(prepared, "dual")), load, 1e-11)
    x, _ = solve_by_nnls(prepared, case)
    assert answer.status == "solved"
    assert (answer.lam >= 0).all()
    np.testing.assert_allclose(prepared.recover(answer.lam, case), x, atol=1e-9)


def test_the_finish_saves_newton_matrices() -> None:
    prepared = make_prepared(3, 60)
    _, load = make_load(3, prepared)
    counts = {}
    for finish in (True, False):
        solver = FastIpm(finish=finish)
        counts[finish] = solver.solve(solver.prepare(in_form(prepared, "dual")), load, 1e-11).iterations
    assert counts[True] < counts[False]


def test_all_invalid_options_are_named() -> None:
    with pytest.raises(InputError, match=r"finish(.|\n)*single"):
        FastIpm(finish="no", single=2)  # type: ignore[arg-type]
