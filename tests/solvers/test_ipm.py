"""The interior-point methods: their schemes, its stopping rule, and what it says when it cannot."""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from refusals import refusal_of
from sample_size import ASKED
from small_problems import by_nnls, definite, make_load, make_prepared, solve_by_nnls

from problems.errors import InputError
from problems.forms.assembly import DualLoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from solvers.algorithms.interior_point import NewtonSteps, Point, algorithm_3, algorithm_5, mehrotra
from solvers.algorithms.preconditioner import SYSTEMS
from solvers.base import Answer
from solvers.methods.ipm import Ipm
from solvers.methods.ipm_fast import FastIpm

STARTS = ("algorithm_4", "algorithm_5", "stp1", "stp2", "mehrotra")
SCHEMES = ("algorithm_3", "mehrotra")
#: Each start with each scheme, and each scheme with each system; of all three with RIVETBENCH_LONG.
COMBINATIONS = [
    each
    for each in product(STARTS, SCHEMES, (*SYSTEMS, "open_last"))
    if ASKED or each[0] == "algorithm_5" or each[2] == "V"
]


def solved(Q: np.ndarray, p: np.ndarray, tolerance: float = 1e-14, **options: Any) -> Answer:
    solver = Ipm(**options)
    ready = solver.prepare(SimpleNamespace(Q=Q))  # type: ignore[arg-type]
    return solver.solve(ready, DualLoadCase(np.zeros(0), np.zeros(0), p), tolerance)


def drawn(size: int, seed: int, condition: float = 1e4) -> tuple[np.ndarray, np.ndarray]:
    """Q and p."""
    return definite(size, seed, condition), np.random.default_rng(seed).standard_normal(size)


def newton(Q: np.ndarray, p: np.ndarray) -> tuple[NewtonSteps, Point]:
    system = SYSTEMS["direct"](Q)
    system.begin()
    made = NewtonSteps(Q, p, system, 0.995, 1e-3, np.inf)
    start = algorithm_5(Q, p)
    return made, made.at(start.lam, start.y)


@pytest.mark.parametrize("seed", range(6))
def test_the_method_solves_and_keeps_its_own_stopping_rule(seed: int) -> None:
    """A looser tolerance takes fewer iterations, and vouches for less."""
    (Q, p), iterations = drawn(25, seed, condition=1e3), []
    for tolerance in (1e-2, 1e-6, 1e-10, 1e-14):
        answer = solved(Q, p, tolerance)
        assert answer.status == "solved"
        assert answer.details["mu"] <= tolerance
        assert answer.details["infeasibility"] <= 1e-3 * np.sqrt(tolerance)
        iterations.append(answer.iterations)
    assert iterations[0] < iterations[-1]
    assert iterations == sorted(iterations)
    np.testing.assert_allclose(answer.lam, by_nnls(Q, p), atol=1e-6)
    counts = answer.details["cg"]
    assert len(counts["predictor"]) == len(counts["corrector"]) == answer.iterations
    assert sum(counts["predictor"]) + sum(counts["corrector"]) == answer.inner_iterations


@pytest.mark.parametrize(("start", "scheme", "system"), COMBINATIONS)
def test_every_start_scheme_and_system_leads_to_the_same_answer(start: str, scheme: str, system: str) -> None:
    prepared: Prepared = make_prepared(3, pairs=20, tools=4)
    case, load = make_load(3, prepared)
    options: dict[str, Any] = {"start": start, "scheme": scheme, "cg_tolerance": 1e-10}
    options |= {"ordering": system} if system == "open_last" else {"preconditioner": system}
    solver = Ipm(**options)
    answer = solver.solve(solver.prepare(in_form(prepared, "dual")), load, 1e-14)
    if system == "none" and answer.status != "solved":
        # In the norm without V the large D hide the rest of the residual: it may not get there, but says so.
        assert answer.status == "inaccurate"
        assert "× the required accuracy" in answer.details["cause"]
        return
    assert answer.status == "solved", answer.details
    x, _ = solve_by_nnls(prepared, case)
    np.testing.assert_allclose(prepared.recover(answer.lam, case), x, atol=1e-7)


@pytest.mark.parametrize("scheme", [algorithm_3, mehrotra])
def test_a_feasible_iteration_stays_feasible_to_rounding(scheme: Any) -> None:
    Q, p = drawn(40, 1)
    state, point = newton(Q, p)
    for _ in range(12):
        point = scheme(state, point)
        size = float((abs(Q) @ point.lam + abs(p) + point.y).max())
        assert abs(point.s1).max() <= 100 * np.finfo(float).eps * size
        assert point.lam.min() > 0
        assert point.y.min() > 0


def test_a_direction_solves_the_printed_system() -> None:
    """One step against the full Newton matrix of (12), its third row read as (0, Λ, Y), on the dual QP.

    There the unknowns are (λ, w, y) with −λ + w = 0 as the constraint rows.
    """
    (Q, p), sigma = drawn(6, 2), 0.3
    state, point = newton(Q, p)
    lam, y, eye, zero = point.lam, point.y, np.eye(6), np.zeros((6, 6))
    full = np.block([[Q, zero, -eye], [-eye, eye, zero], [zero, np.diag(y), np.diag(lam)]])
    s1, s2, s3 = -(Q @ lam - p - y), np.zeros(6), -(lam * y - sigma * point.mu)
    step = np.linalg.solve(full, np.concatenate([s1, s2, s3]))
    dlam, dw, dy = np.split(step, 3)
    np.testing.assert_allclose(dw, dlam, atol=1e-8)  # w = λ is kept
    ratios = [-v / d for v, d in zip(np.r_[lam, y], np.r_[dlam, dy], strict=True) if d < 0]
    alpha = min(1.0, 0.995 * min(ratios))
    found = state.moved(point, *state.direction(point, s3, "predictor"))
    np.testing.assert_allclose(found.lam, lam + alpha * dlam, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(found.y, y + alpha * dy, rtol=1e-8, atol=1e-8)


def test_algorithm_3_takes_two_newton_steps() -> None:
    state, point = newton(*drawn(10, 4))

    def step(point: Point, sigma: float) -> Point:
        return state.moved(
            point, *state.direction(point, sigma * point.mu - point.lam * point.y, "predictor")
        )

    predicted = step(point, 0.0)
    wanted = step(predicted, (predicted.mu / point.mu) ** 3)
    found = algorithm_3(state, point)
    np.testing.assert_allclose(found.lam, wanted.lam, rtol=1e-12)
    np.testing.assert_allclose(found.y, wanted.y, rtol=1e-12)


@pytest.mark.parametrize("system", ["V", "direct"])
def test_a_start_anew_with_shorter_steps_frees_what_has_jammed(
    system: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Algorithm 3 takes its predictor step to 0.5 % of the boundary, and here it cannot leave it again."""
    Q = np.array([[0.571432186, 8.92851495e-3], [8.92851495e-3, 1.39509811e-4]])
    p = np.array([1.28726556, 0.02011341])
    answer = solved(Q, p, preconditioner=system)
    assert (answer.status, answer.details["restarts"]) == ("solved", 1)
    np.testing.assert_allclose(Q @ answer.lam, p, atol=1e-10)
    assert (answer.lam > 0).all()
    monkeypatch.setattr("solvers.methods.ipm.RESTARTS", ())
    assert solved(Q, p, preconditioner=system).status == "inaccurate"


@pytest.mark.parametrize("compliance", [1.0, 1e4])
def test_a_contact_that_touches_without_a_force_is_not_left_standing_off(compliance: float) -> None:
    """At μ = 1e-14 N·mm alone it would keep a gap of √(μ q), 1e-5 mm here where q = 1e4 mm/N."""
    answer = solved(np.diag([compliance, compliance]), np.array([0.0, 1.0]))
    assert answer.status == "solved"
    touch = np.sqrt(0.1 * 1e-14)  # mm
    np.testing.assert_allclose(np.array([1.0, 1.0]) * compliance * answer.lam, [0.0, 1.0], atol=touch)


def test_the_tolerance_is_an_energy_in_the_units_of_the_session() -> None:
    """In lengths of 2¹¹ mm the session asks 2⁻¹¹ of the tolerance, and the energy is 2²² as large."""
    prepared = make_prepared(2, 20, 5)
    solver, (_, load) = Ipm(), make_load(3, prepared)
    state = solver.prepare(in_form(prepared, "dual"))
    answer = solver.solve(state, replace(load, energy=2.0**22), 1e-9 / 2**11)
    assert answer.details["mu"] <= 1e-9 / 2**22 < solver.solve(state, load, 1e-9).details["mu"]


def test_no_feasibility_is_asked_for_below_rounding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("solvers.methods.ipm.FEASIBILITY", 1e-10)
    Q, p = drawn(20, 6, condition=1e3)
    p = 1e12 * p
    answer = solved(Q, p, tolerance=1.0)
    assert answer.status == "solved"
    size = abs(p).max() + abs(Q).max() * answer.lam.sum()
    assert 1e-10 < answer.details["infeasibility"] < 1e-15 * size


def test_where_no_feasible_start_is_found_another_is_taken() -> None:
    """Two contacts that close each other's gap: Qλ > 0 only for λ₁ between 1.072 and 1.076 λ₂."""
    Q = np.array([[0.00464895, -0.00498223], [-0.00498223, 0.00536092]])
    answer = solved(Q, np.array([3.2364333, -3.81448455]))
    assert answer.status == "solved"
    assert "no λ > 0" in answer.details["start_instead"]
    np.testing.assert_allclose(Q @ answer.lam, [3.2364333, -3.4684], atol=1e-3)


def test_conjugate_gradients_that_stagnate_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a step it does not call itself solved, and says what held it up."""
    monkeypatch.setattr("solvers.algorithms.interior_point.CG_LIMIT", 0)
    answer = solved(definite(40, 0), np.ones(40))
    assert answer.status == "inaccurate"
    assert answer.details["restarts"] == 2
    assert answer.details["cg_unconverged"] > 0
    assert "unconverged CG" in answer.details["cause"]


def test_all_wrong_options_are_named_at_once() -> None:
    error = refusal_of(Ipm, cg_tolerance=0.0, max_cg=0, start="", scheme="", preconditioner="W")
    keys = {fault.key.removeprefix("options.") for fault in error.faults}
    assert keys == {"cg_tolerance", "max_cg", "start", "scheme", "preconditioner"}
    with pytest.raises(InputError, match="open_last with V only"):
        Ipm(preconditioner="none", ordering="open_last")


def test_a_large_y_does_not_hide_an_overlap() -> None:
    """y − s1 would be Qλ − p in exact arithmetic; of a y of 1e20 mm, rounding leaves none of it."""
    newton = NewtonSteps(np.eye(2), np.array([3.0, 1.0]), SYSTEMS["direct"](np.eye(2)), 0.9, 1e-3, 100)
    point = newton.at(np.ones(2), np.full(2, 1e20))
    np.testing.assert_array_equal(point.gap, [-2.0, 0.0])
    assert point.infeasibility() >= 2.0
    assert Point(np.ones(2), np.ones(2), np.array([-2.0, 0.0])).s1.tolist() == [3.0, 1.0]


def test_the_finish_saves_newton_matrices(monkeypatch: pytest.MonkeyPatch) -> None:
    prepared = make_prepared(3, 60)
    _, load = make_load(3, prepared)
    solver, counts = FastIpm(), []
    for ratio in (1e-4, 0.0):  # at 0 the interior point is followed to its end
        monkeypatch.setattr("solvers.methods.ipm_fast.IDENTIFICATION_RATIO", ratio)
        counts.append(solver.solve(solver.prepare(in_form(prepared, "dual")), load, 1e-11).iterations)
    assert counts[0] < counts[1]
