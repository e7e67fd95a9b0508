"""The textbook's methods: the sets, sweeps and digits they go through, and what they say of their answers."""

from typing import Any

import numpy as np
import pytest
from small_problems import make_load, make_prepared, make_strips, solve_by_nnls

from harness.verification.judge import conditioned_limit
from problems.forms.assembly import LoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.scene_files import read_scene
from solvers.base import Answer, WarmStart
from solvers.registry import make_solver

EPS = float(np.finfo(float).eps)
STRIPS = make_strips(60)
CASE, LOAD = make_load(3, STRIPS)


def solved(
    name: str,
    prepared: Prepared = STRIPS,
    load: LoadCase = LOAD,
    tolerance: float = 1e-10,
    start: WarmStart | None = None,
    **options: Any,
) -> Answer:
    solver = make_solver(name, options)
    state = solver.prepare(in_form(prepared, "dual"))
    ready = state if start is None else solver.update(state, state, load, tolerance, start)
    return solver.solve(ready, load, tolerance)


def test_the_active_set_ends_with_the_closed_contacts_from_any_start() -> None:
    answer = solved("textbook-active-set")
    _, lam = solve_by_nnls(STRIPS, CASE)
    assert answer.status == "solved"
    assert ((answer.lam > 0) == (lam > 0)).all()
    assert answer.iterations > 1
    from_answer = WarmStart(LOAD, answer.lam, STRIPS.Q @ answer.lam - LOAD.p)
    assert solved("textbook-active-set", start=from_answer).iterations == 1
    nothing = WarmStart(LOAD, np.zeros_like(LOAD.p), -LOAD.p)
    assert np.allclose(solved("textbook-active-set", start=nothing).lam, answer.lam)


@pytest.mark.parametrize("relaxation", [0.5, 1.0, 1.5, 1.9])
def test_gauss_seidel_converges_for_any_relaxation_below_two(relaxation: float) -> None:
    x, _ = solve_by_nnls(STRIPS, CASE)
    answer = solved("projected-gauss-seidel", relaxation=relaxation)
    assert answer.status == "solved"
    np.testing.assert_allclose(STRIPS.recover(answer.lam, CASE), x, rtol=0, atol=1e-8)


@pytest.mark.parametrize("rung", ["1e+06", "1e+08", "1e+10"])
def test_gauss_seidel_gives_up_rather_than_be_wrong(rung: str) -> None:
    made = read_scene(f"hard/conditioning/{rung}").made
    prepared = Prepared(made.assembly)
    (load,) = prepared.with_p([made.load])
    answer = solved("projected-gauss-seidel", prepared, load)
    if answer.status == "solved":
        off = abs(prepared.recover(answer.lam, load) - made.x).max()
        assert off <= conditioned_limit(1e-7, float(rung), abs(made.x).max())
    else:
        assert "did not halve" in answer.details["cause"]


@pytest.mark.parametrize(("kind", "seed"), [*(("parts", seed) for seed in range(3)), ("strips", 1)])
def test_l_bfgs_b_ends_where_its_objective_is_rounded(kind: str, seed: int) -> None:
    """½‖x − x*‖²_K = ½‖λ − λ*‖²_Q ≤ f(λ) − f(λ*), and rounding leaves a few ε|f|."""
    prepared = make_prepared(seed, 20, 5) if kind == "parts" else make_strips(40)
    case, load = make_load(seed, prepared)
    x, lam = solve_by_nnls(prepared, case)
    answer = solved("l-bfgs-b", prepared, load, 1e-9)
    assert answer.status in ("inaccurate", "solved")  # SciPy 1.18 may meet the tolerance by its last step
    objective = load.p @ lam / 2
    compliance = np.diag(prepared.assembly.K.solve(np.eye(prepared.assembly.n))).max()
    off = abs(prepared.recover(answer.lam, case) - x).max()
    assert off <= np.sqrt(2 * 10 * EPS * objective * compliance)
