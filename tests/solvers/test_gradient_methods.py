"""MPRGP, projected Newton, Lemke and Gauss–Seidel: steps, what they count, and where they start."""

from typing import Any

import numpy as np
import pytest
from small import make_load, make_prepared, make_strips, solve_by_nnls

from harness.verification.judge import conditioned_limit
from problems.forms import product
from problems.forms.assembly import LoadCase, Vector
from problems.forms.banded_inverse import banded_inverse
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.scene import read_scene
from solvers.active_set import parametric_path
from solvers.active_set.contact_sets import OpenFactor
from solvers.active_set.parametric_path import ParametricPath
from solvers.base import Answer, WarmStart
from solvers.gradient_projection.metric import Band, Diagonal, Face, step_length
from solvers.gradient_projection.proportioning import Proportioning
from solvers.methods import projected_newton
from solvers.registry import make_solver

TOLERANCE = 1e-10
VARIANTS: list[tuple[str, dict[str, Any]]] = [
    *(("mprgp", {"preconditioner": kind}) for kind in ("band", "face", "none")),
    ("projected-newton", {}),
    ("lemke", {}),
]


def strips(contacts: int) -> tuple[Prepared, LoadCase]:
    """Contacts in a row, five windows of M long and more, with nearly as many open as closed."""
    prepared = make_strips(contacts)
    return prepared, make_load(3, prepared)[1]


def solved(name: str, options: dict[str, Any], prepared: Prepared, load: LoadCase) -> Answer:
    solver = make_solver(name, options)
    state = solver.prepare(solver.convert(in_form(prepared, "dual")))
    return solver.solve(solver.setup(state, load, TOLERANCE), load, TOLERANCE)


@pytest.mark.parametrize(("name", "options"), VARIANTS, ids=str)
@pytest.mark.parametrize("kind", ["parts", "strips"])
def test_each_variant_agrees_with_nnls(name: str, options: dict[str, Any], kind: str) -> None:
    if kind == "parts":
        prepared = make_prepared(2, 20, 5)
        load = make_load(3, prepared)[1]
    else:
        prepared, load = strips(400)
    x, lam = solve_by_nnls(prepared, load)
    assert 0 < np.count_nonzero(lam) < len(lam)
    answer = solved(name, options, prepared, load)
    assert answer.status == "solved"
    np.testing.assert_allclose(prepared.recover(answer.lam, load), x, rtol=0, atol=1e-8)


def metrics(prepared: Prepared) -> dict[str, Diagonal]:
    Q = prepared.Q
    M, d = banded_inverse(Q, None), np.diag(Q).copy()
    alpha = step_length(prepared.compliance, d)
    return {
        "band": Band(d, 1.0, OpenFactor(M)),
        "face": Face(d, alpha, OpenFactor(M)),
        "none": Diagonal(d, alpha),
    }


@pytest.mark.parametrize("kind", ["band", "face", "none"])
def test_no_step_increases_the_objective(kind: str) -> None:
    prepared, load = strips(400)
    Q, p = prepared.Q, load.p
    metric = metrics(prepared)[kind]
    case = Proportioning(prepared.compliance, p, metric.diagonal, metric, lambda lam: Q @ lam - p, 0 * p, -p)
    before = 0.0
    for _ in range(200):
        if not case._step():
            break
        assert case.lam.min() >= 0
        np.testing.assert_allclose(case.y, Q @ case.lam - p, rtol=0, atol=1e-9 * abs(p).max())
        objective = float(case.lam @ (Q @ case.lam / 2 - p))
        assert objective <= before + 1e-13 * abs(before)
        before = objective
    assert set(case.steps) == {"cg", "expansion", "proportioning"}
    assert case.steps["cg"] * case.steps["proportioning"] > 0


@pytest.mark.parametrize(("name", "options"), VARIANTS, ids=str)
def test_the_products_that_are_told_are_those_made(
    name: str, options: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []
    for module in (product, parametric_path, projected_newton):
        original = module.product  # type: ignore[attr-defined]

        def counted(Q: Any, v: Vector, original: Any = original) -> Vector:
            made.append(1)
            found: Vector = original(Q, v)
            return found

        monkeypatch.setattr(module, "product", counted)
    prepared, load = strips(120)
    solver = make_solver(name, options)
    state = solver.prepare(solver.convert(in_form(prepared, "dual")))
    made.clear()
    answer = solver.solve(solver.setup(state, load, TOLERANCE), load, TOLERANCE)
    assert answer.details["products"] == len(made) > 0


@pytest.mark.parametrize(("name", "options"), VARIANTS, ids=str)
def test_from_its_own_answer_little_is_left_to_do(name: str, options: dict[str, Any]) -> None:
    prepared, load = strips(120)
    cold = solved(name, options, prepared, load)
    solver = make_solver(name, options)
    state = solver.prepare(solver.convert(in_form(prepared, "dual")))
    start = WarmStart(load, cold.lam, prepared.Q @ cold.lam - load.p)
    warm = solver.solve(solver.update(state, state, load, TOLERANCE, start), load, TOLERANCE)
    assert warm.status == "solved"
    assert warm.details["products"] <= min(5, cold.details["products"])


def test_a_path_solves_the_problem_at_each_of_its_points() -> None:
    """λ and y are those of p − td, and of the contacts of C and of the others none has the wrong sign."""
    prepared, load = strips(60)
    Q, p, d = prepared.Q, load.p, np.full(60, 1.0)
    path = ParametricPath(Q, p, d, float(p.max()), np.empty(0, dtype=np.intp))
    while path.t > 0:
        before = path.t
        path._pivot()
        assert path.t <= before
        np.testing.assert_allclose(path.y, Q @ path.lam - p + path.t * d, rtol=0, atol=1e-12 * abs(p).max())
        assert path.lam.min() >= -1e-9
        assert path.y.min() >= -1e-12
        assert abs(path.y[path.lam > 0]).max(initial=0.0) <= 1e-12 * abs(p).max()
    _, lam = solve_by_nnls(prepared, load)
    np.testing.assert_allclose(path.lam, lam, rtol=0, atol=1e-6)


def test_contacts_that_reach_zero_together_do_not_stop_a_path() -> None:
    """A uniform load on equal strips: p is symmetric, and d = 1 leaves every tie as it is."""
    prepared = make_strips(41)
    f = np.r_[np.full(41, 1e3), np.full(41, -1e3)]
    case = LoadCase(f, np.full(41, 0.1))
    p = prepared.dual_load(case)
    np.testing.assert_allclose(p, p[::-1], rtol=1e-12)
    path = ParametricPath(prepared.Q, p, np.ones(41), float(p.max()), np.empty(0, dtype=np.intp))
    assert path.follow(1000)
    np.testing.assert_allclose(path.lam, solve_by_nnls(prepared, case)[1], rtol=0, atol=1e-6)


@pytest.mark.parametrize("relaxation", [0.5, 1.0, 1.5, 1.9])
def test_gauss_seidel_converges_for_any_relaxation_below_two(relaxation: float) -> None:
    prepared, load = strips(40)
    x, _ = solve_by_nnls(prepared, load)
    answer = solved("projected-gauss-seidel", {"relaxation": relaxation}, prepared, load)
    assert answer.status == "solved"
    np.testing.assert_allclose(prepared.recover(answer.lam, load), x, rtol=0, atol=1e-8)


@pytest.mark.parametrize("rung", ["1e+06", "1e+08", "1e+10"])
def test_gauss_seidel_gives_up_rather_than_be_wrong(rung: str) -> None:
    made = read_scene(f"hard/conditioning/{rung}").made
    prepared = Prepared(made.assembly)
    load = LoadCase(made.load.f, made.load.g, prepared.dual_load(made.load))
    answer = solved("projected-gauss-seidel", {}, prepared, load)
    if answer.status == "solved":
        off = abs(prepared.recover(answer.lam, load) - made.x).max()
        assert off <= conditioned_limit(1e-7, float(rung), abs(made.x).max())
    else:
        assert "did not halve" in answer.details["cause"]
