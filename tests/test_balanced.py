"""Balanced units of the sparse form: exact, the same answer in any units; and the libraries in them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from small import make_load, make_prepared
from solving import TESTED

from harness.solving.session import SolverSession
from harness.verification.reference import reference
from problems.build import load_case, prepared
from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.forms.problem import Problem, in_form
from problems.scene import read_scene
from problems.stiffness.operator import Stiffness
from solvers.balanced import Units, balanced
from solvers.base import Answer, Form, WarmStart
from solvers.registry import in_house, make_solver

#: The libraries that take the sparse form.
TAKEN = [name for name in TESTED if not in_house(name) and "sparse" in make_solver(name, {}).forms]


@cache
def opened(name: str) -> tuple[Problem, LoadCase]:
    """A scene of the gallery in the sparse form, and its load case."""
    scene = read_scene(f"gallery/{name}")
    problem = in_form(prepared(scene, form="sparse"), "sparse")
    (load,) = problem.loads([load_case(scene, form="sparse")])
    return problem, load


@cache
def certified(name: str) -> tuple[Vector, Vector]:
    """x and λ, by condensation and the referee."""
    scene = read_scene(f"gallery/{name}")
    found = reference(prepared(scene), load_case(scene))
    assert found.bound_mm < 1e-9
    return found.x, found.lam


def is_power_of_two(values: Vector) -> bool:
    return bool((np.frexp(values)[0] == 0.5).all())


# Scaling.


def test_a_model_in_balanced_units_and_back_is_the_same_to_the_last_bit() -> None:
    given, load = opened("three-part-stack")
    problem, units = balanced(given)
    assert units is not None
    D, R, u = units.D, units.R, units.unit(load)
    assert is_power_of_two(D)
    assert is_power_of_two(R)
    assert is_power_of_two(np.array([u]))
    assert len(set(D)) > 3  # mixed units indeed
    for K, mine, rows in zip(given.blocks, problem.blocks, given.assembly.K.slices, strict=True):
        back = sp.diags_array(1 / D[rows]) @ mine @ sp.diags_array(1 / D[rows])
        assert abs(back - K).max() == 0
    back = sp.diags_array(1 / D) @ problem.assembly.A @ sp.diags_array(1 / R)
    assert abs(back - given.assembly.A).max() == 0
    own = units.load(load)
    np.testing.assert_array_equal(u * own.f / D, load.f)
    np.testing.assert_array_equal(u * own.g / R, load.g)


def test_everything_is_of_the_size_of_one() -> None:
    given, load = opened("three-part-stack")
    problem, units = balanced(given)
    assert units is not None
    diagonal = problem.assembly.K.diagonal
    assert 0.5 <= diagonal.min() <= diagonal.max() <= 2
    assert problem.G is not None
    lengths = np.sqrt(problem.G.power(2).sum(axis=1))
    assert 0.5 <= lengths.min() <= lengths.max() < 1
    own = units.load(load)
    assert 0.5 <= max(abs(own.f).max(), abs(own.g).max()) < 1


def test_a_case_without_loads_and_gaps_has_the_unit_one() -> None:
    given, load = opened("three-part-stack")
    assert Units.of(given.assembly).unit(LoadCase(0 * load.f, 0 * load.g)) == 1


def test_an_answer_and_a_warm_start_are_mapped_to_each_other() -> None:
    given, load = opened("three-part-stack")
    units = Units.of(given.assembly)
    random = np.random.default_rng(0)
    lam, x = random.random(given.assembly.m), random.random(given.assembly.n)
    next_load = LoadCase(8 * load.f, 8 * load.g)
    start = units.start(WarmStart(load, lam, load.g - given.assembly.A.T @ x, x), next_load)
    back = units.answer(Answer("solved", start.lam, start.x), next_load)
    np.testing.assert_array_equal(back.lam, lam)
    np.testing.assert_array_equal(back.x, x)
    problem = units.problem(given)
    gap = units.load(load).g / 8 - problem.assembly.A.T @ start.x
    np.testing.assert_allclose(start.gap, gap, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(8 * start.load.f, units.load(load).f)


@pytest.mark.parametrize("form", ["primal", "dual"])
def test_nothing_is_scaled_in_the_dense_forms(form: Form) -> None:
    given = make_prepared(3, 6)
    problem = in_form(given, form)
    assert balanced(problem) == (problem, None)
    (load,) = problem.loads([make_load(4, given)[0]])
    session = SolverSession(make_solver("clarabel", {}), problem, 1e-9)
    session.open()
    assert session.cold(load).details == {"status": "Solved"}


def test_the_gap_may_be_what_it_is_in_the_other_forms() -> None:
    given, load = opened("three-part-stack")
    units = Units.of(given.assembly)
    u = units.unit(load)
    assert u > 1
    assert units.gap_tolerance(1e-6, load) == 1e-6 / u**2
    assert units.gap_tolerance(1e-10, load) == 1e-13  # rounding
    assert units.gap_tolerance(1e-300, load) == 1e-300  # asked for more than that
    small = LoadCase(load.f / u / 1024, load.g / u / 1024)
    assert units.gap_tolerance(1e-9, small) == 1e-9


@pytest.mark.parametrize("name", TAKEN)
def test_the_answer_does_not_depend_on_the_units_of_the_model(name: str) -> None:
    """Unknowns and contacts in other units by powers of two: the same answer to the last bit."""
    random = np.random.default_rng(1)
    base = make_prepared(2, 20, 5)
    case, _ = make_load(3, base)
    problem = in_form(base, "sparse")
    n, m = base.assembly.n, base.assembly.m
    S, C = np.exp2(random.integers(-20, 21, n)), np.exp2(random.integers(-20, 21, m))
    blocks = tuple(
        sp.csc_array(sp.diags_array(S[rows]) @ K @ sp.diags_array(S[rows]))
        for K, rows in zip(problem.blocks, base.assembly.K.slices, strict=True)
    )
    A = sp.csc_array(sp.diags_array(S) @ base.assembly.A @ sp.diags_array(C))
    other = in_form(Prepared(Assembly(Stiffness.of(*blocks), A)), "sparse")
    changed = LoadCase(S * case.f, C * case.g)
    answers = []
    for each, given in ((problem, case), (other, changed)):
        (load,) = each.loads([given])
        session = SolverSession(make_solver(name, {}), each, 1e-9)
        session.open()
        answers.append(session.cold(load))
    one, two = answers
    assert one.lam is not None
    assert one.x is not None
    assert two.details["unit"] == one.details["unit"]
    np.testing.assert_array_equal(two.lam, one.lam / C)
    np.testing.assert_array_equal(two.x, one.x / S)


# Scenes.


@pytest.mark.parametrize(
    ("name", "scene", "limit_mm"),
    [
        *((name, "heavy-sheet-on-tool", 1e-8) for name in TAKEN),
        # HiGHS's active-set method keeps a dense matrix of the order of the free unknowns, at most 4000.
        *((name, "three-part-stack", 1e-6) for name in TAKEN if name != "highs"),
    ],
)
def test_a_library_solves_the_finite_element_model(name: str, scene: str, limit_mm: float) -> None:
    problem, load = opened(scene)
    x, lam = certified(scene)
    assert 0 < np.count_nonzero(lam) < len(lam)
    session = SolverSession(make_solver(name, {}), problem, 1e-9)
    session.open()
    answer = session.cold(load)
    assert answer.status == "solved"
    assert answer.lam is not None
    assert answer.x is not None
    assert answer.details["balanced"] is True
    assert answer.details["unit"] == Units.of(problem.assembly).unit(load)
    np.testing.assert_allclose(problem.assembly.at_junction(answer.x), x, rtol=0, atol=limit_mm)
    assert answer.lam.sum() == pytest.approx(lam.sum(), rel=1e-6)
