"""SciPy's optimisers: what they say of their answers, and how far off these are."""

from __future__ import annotations

from itertools import product
from types import ModuleType

import numpy as np
import pytest
from small import make_load, make_prepared, make_strips, solve_by_nnls

from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from solvers.base import Answer
from solvers.libraries import l_bfgs_b, slsqp, trust_constr
from solvers.registry import make_solver

LIMIT_MM = 1e-7
EPS = float(np.finfo(float).eps)


def solved(name: str, prepared: Prepared, load: LoadCase, tolerance: float = 1e-9) -> Answer:
    solver = make_solver(name, {})
    state = solver.prepare(solver.convert(in_form(prepared, "dual")))
    return solver.solve(solver.setup(state, load, tolerance), load, tolerance)


@pytest.mark.parametrize(
    ("kind", "seed"), [*(("parts", seed) for seed in range(5)), ("strips", 1), ("strips", 3)]
)
def test_l_bfgs_b_ends_where_its_objective_is_rounded(kind: str, seed: int) -> None:
    """½‖x − x*‖²_K = ½‖λ − λ*‖²_Q ≤ f(λ) − f(λ*), and rounding leaves a few ε|f|."""
    prepared = make_prepared(seed, 20, 5) if kind == "parts" else make_strips(40)
    case, load = make_load(seed, prepared)
    x, lam = solve_by_nnls(prepared, case)
    answer = solved("l-bfgs-b", prepared, load)
    assert answer.lam is not None
    assert answer.status == "inaccurate"
    objective = load.p @ lam / 2
    compliance = np.diag(prepared.assembly.K.solve(np.eye(prepared.assembly.n))).max()
    off = abs(prepared.recover(answer.lam, case) - x).max()
    assert off <= np.sqrt(2 * 10 * EPS * objective * compliance)


@pytest.mark.parametrize("name", ["slsqp", "trust-constr"])
@pytest.mark.parametrize("seed", range(5))
def test_the_others_are_within_the_limit_on_easy_problems(name: str, seed: int) -> None:
    prepared = make_prepared(seed, 20, 5)
    case, load = make_load(seed, prepared)
    x, _ = solve_by_nnls(prepared, case)
    answer = solved(name, prepared, load)
    assert answer.lam is not None
    assert abs(prepared.recover(answer.lam, case) - x).max() <= LIMIT_MM


@pytest.mark.parametrize("name", ["slsqp", "trust-constr"])
def test_solved_is_said_of_what_is_optimal_to_the_tolerance_and_of_nothing_else(name: str) -> None:
    """SciPy calls each of these a success."""
    said = set()
    for seed, tolerance in product(range(2), (1e-3, 1e-12)):
        prepared = make_prepared(seed, 20, 5)
        _, load = make_load(seed, prepared)
        answer = solved(name, prepared, load, tolerance)
        assert answer.lam is not None
        off = abs(np.minimum(answer.lam, prepared.Q @ answer.lam - load.p)).max()
        assert (answer.status == "solved") == (off <= tolerance)
        assert any(word in answer.details["message"] for word in ("successfully", "is satisfied"))
        said.add(answer.status)
    assert said == {"solved", "inaccurate"}


@pytest.mark.parametrize(
    ("name", "tolerance"), [("l-bfgs-b", 1e-300), ("slsqp", 1e-300), ("trust-constr", 1e-16)]
)
def test_one_that_met_no_tolerance_does_not_say_solved(name: str, tolerance: float) -> None:
    prepared = make_strips(40)
    _, load = make_load(3, prepared)
    answer = solved(name, prepared, load, tolerance)
    assert answer.status == "inaccurate"
    assert answer.details["products"] > 10


@pytest.mark.parametrize("module", [l_bfgs_b, slsqp, trust_constr])
def test_a_limit_that_was_reached_is_said(module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LIMIT", 3)
    prepared = make_strips(40)
    _, load = make_load(3, prepared)
    name = module.__name__.rpartition(".")[2].replace("_", "-")
    assert solved(name, prepared, load).status == "iteration_limit"
