"""SciPy's L-BFGS-B: what it says of its answers, and how far off these are."""

import numpy as np
import pytest
from small import make_load, make_prepared, make_strips, solve_by_nnls

from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from solvers.base import Answer
from solvers.registry import make_solver

EPS = float(np.finfo(float).eps)


def solved(prepared: Prepared, load: LoadCase, tolerance: float = 1e-9) -> Answer:
    solver = make_solver("l-bfgs-b", {})
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
    answer = solved(prepared, load)
    assert answer.status == "inaccurate"
    objective = load.p @ lam / 2
    compliance = np.diag(prepared.assembly.K.solve(np.eye(prepared.assembly.n))).max()
    off = abs(prepared.recover(answer.lam, case) - x).max()
    assert off <= np.sqrt(2 * 10 * EPS * objective * compliance)


def test_one_that_met_no_tolerance_does_not_say_solved() -> None:
    prepared = make_strips(40)
    _, load = make_load(3, prepared)
    answer = solved(prepared, load, 1e-300)
    assert answer.status == "inaccurate"
    assert answer.details["products"] > 10
