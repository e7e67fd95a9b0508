"""The change of units: exact, undone on the answer, and the same answer in any units from every solver."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from sample_size import ASKED
from small_problems import make_load, make_prepared, problem_in, solve_by_nnls
from solver_forms import CASES, IN_HOUSE, SLOW, TESTED, TOLERANCES, WRITTEN_HERE

from harness.solving.solver_session import SolverSession
from harness.verification.reference import reference
from problems.build import load_case, prepared
from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.forms.problem import Problem
from problems.forms.solver_units import Units
from problems.scene_files import read_scene
from problems.stiffness.operator import Stiffness
from solvers.adapter import gap_tolerance
from solvers.base import Answer, Form, Solver
from solvers.registry import make_solver, owner_of

#: The libraries that take the sparse form.
TAKEN = [name for name in TESTED if owner_of(name) == "library" and "sparse" in make_solver(name, {}).forms]


@cache
def opened(name: str) -> tuple[Problem, LoadCase]:
    """A scene of the gallery in the sparse form, and its load case."""
    scene = read_scene(f"gallery/{name}")
    problem = problem_in(prepared(scene, form="sparse"), "sparse")
    (load,) = problem.loads([load_case(scene, form="sparse")])
    return problem, load


@cache
def certified(name: str) -> tuple[Vector, Vector]:
    """x and λ, by condensation and the referee."""
    scene = read_scene(f"gallery/{name}")
    found = reference(prepared(scene), load_case(scene))
    assert found.bound_mm < 1e-9
    return found.x, found.lam


def rescaled(original: Prepared, case: LoadCase, S: Vector, C: Vector) -> tuple[Prepared, LoadCase]:
    """In x' = x/S and λ' = λ/C."""
    K = original.assembly.K
    blocks = [S[rows, None] * block * S[rows] for block, rows in zip(K.matrices, K.slices, strict=True)]
    A = sp.csc_array(sp.diags_array(S) @ original.assembly.A @ sp.diags_array(C))
    return Prepared(Assembly(Stiffness.of(*blocks), A)), LoadCase(S * case.f, C * case.g)


def powers(seed: int, size: int, bits: int) -> Vector:
    return np.exp2(np.random.default_rng(seed).integers(-bits, bits + 1, size))


def opened_session(name: str, problem: Problem, tolerance: float) -> SolverSession:
    session = SolverSession(make_solver(name, {}), problem, tolerance)
    session.open(batched=True)
    return session


# The change itself.


@pytest.mark.parametrize("form", ["primal", "dual"])
def test_a_joint_in_mm_is_passed_on_untouched(form: Form) -> None:
    given = make_prepared(1, 8)
    problem = problem_in(given, form)
    (load,) = problem.loads([make_load(2, given)[0]])
    units = Units.of(problem).of_loads([load])
    assert units.scaled() is problem
    assert units.load(load) is load
    assert units.length == 1.0
    assert gap_tolerance(1e-9, units.load(load)) == 1e-9


def test_a_model_in_other_units_and_back_is_the_same_to_the_last_bit() -> None:
    original, load = opened("three-part-stack")
    units = Units.of(original).of_loads([load])
    problem, inside = units.scaled(), units.load(load)
    D, R, U = units.D, units.R, units.U
    assert (np.frexp(np.concatenate([D, R, [U]]))[0] == 0.5).all()
    assert len(set(D)) > 3  # mixed units indeed
    for K, mine, rows in zip(original.blocks, problem.blocks, original.assembly.K.slices, strict=True):
        assert abs(sp.diags_array(1 / D[rows]) @ mine @ sp.diags_array(1 / D[rows]) - K).max() == 0
    back = sp.diags_array(1 / D) @ problem.assembly.A @ sp.diags_array(1 / R)
    assert abs(back - original.assembly.A).max() == 0
    np.testing.assert_array_equal(U * inside.f / D, load.f)
    np.testing.assert_array_equal(U * inside.g / R, load.g)
    random = np.random.default_rng(0)
    lam, x = random.random(original.assembly.m), random.random(original.assembly.n)
    gap = load.g - original.assembly.A.T @ x
    scaled_lam, scaled_gap, scaled_x = units.start(lam, gap, x)
    np.testing.assert_allclose(scaled_gap, inside.g - problem.assembly.A.T @ scaled_x, rtol=0, atol=1e-12)
    for one, other in zip(units.answer(scaled_lam, scaled_x), (lam, x), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_model_in_other_units_has_gaps_in_mm_and_the_factors_of_K() -> None:
    original, load = opened("three-part-stack")
    units = Units.of(original).of_loads([load])
    problem, own = units.scaled(), units.load(load)
    np.testing.assert_array_equal(own.g, load.g)
    assert units.length == 1.0
    K, b = problem.assembly.K, np.random.default_rng(0).standard_normal(original.assembly.n)
    assert np.median(K.diagonal) == pytest.approx(1, rel=1)
    x = K.solve(b)
    np.testing.assert_allclose(K.multiply(x), b, rtol=0, atol=1e-6)
    np.testing.assert_array_equal(K.matrix.diagonal(), K.diagonal)
    np.testing.assert_allclose(K.matrix @ x, K.multiply(x), rtol=0, atol=1e-6)
    for one, other in zip(K.factors, original.assembly.K.factors, strict=True):
        assert one is other
    Q = K.compliance(problem.assembly.A)
    expected = original.assembly.K.compliance(original.assembly.A) * units.R * units.R[:, None]
    np.testing.assert_allclose(Q, expected, rtol=0, atol=1e-12 * Q.max())


class Seen(Solver):
    """Keeps what it is given."""

    forms = ("primal", "dual", "sparse")

    def solve(self, ready: Problem, load: LoadCase, tolerance: float) -> Answer:
        self.problem, self.load, self.tolerance = ready, load, tolerance
        return Answer("failed", None)


class Foreign:
    """An array of another library, as of JAX or PyTorch."""

    def __init__(self, values: Vector) -> None:
        self.values = values

    def __array__(self, dtype: object = None, copy: object = None) -> Vector:
        return self.values.copy()


class Ones(Solver):
    forms = ("sparse",)

    def __init__(self, kind: Callable[[Vector], Any]) -> None:
        self.kind = kind

    def solve(self, ready: Problem, load: LoadCase, tolerance: float) -> Answer:
        lam, x = np.ones(ready.assembly.m), np.ones(ready.assembly.n)
        return Answer("solved", self.kind(lam), self.kind(x))


@pytest.mark.parametrize("kind", [list, Foreign])
def test_an_answer_in_arrays_of_any_kind_has_the_units_of_the_problem(kind: Callable[[Vector], Any]) -> None:
    problem, load = opened("three-part-stack")
    sessions = [SolverSession(Ones(made), problem, 1e-9) for made in (np.asarray, kind)]
    for session in sessions:
        session.open()
    expected, answer = (session.next(load, None) for session in sessions)
    for name in ("lam", "x"):
        np.testing.assert_array_equal(getattr(answer, name), getattr(expected, name))


@pytest.mark.parametrize("form", ["primal", "dual", "sparse"])
@pytest.mark.parametrize("metre", [2.0**-20, 1.0, 2.0**20])
def test_a_tolerance_means_mm_at_a_contact(form: Form, metre: float) -> None:
    """A gap that is τ wide before the change is as wide as the tolerance after it."""
    given = make_prepared(3, 6)
    base, case = rescaled(given, make_load(4, given)[0], np.ones(12), powers(5, 6, 10))
    case = LoadCase(metre * case.f, metre * case.g)
    problem, seen = problem_in(base, form), Seen()
    session = SolverSession(seen, problem, 1e-9)
    session.open()
    (load,) = problem.loads([case])
    session.next(load, None)
    lengths = abs(base.assembly.A).max(axis=0).toarray().ravel()
    in_mm, mine = load.g / lengths, seen.load.g
    ratio = mine / in_mm * 1e-9 / seen.tolerance
    assert (ratio > 0.24).all() if form == "sparse" else (ratio == 1).all()  # the √k_ii differ
    assert (ratio < 4.1).all()


def test_a_case_without_loads_and_gaps_has_the_unit_one() -> None:
    given, load = opened("three-part-stack")
    assert Units.of(given).of_loads([replace(load, f=0 * load.f, g=0 * load.g)]).length == 1


def test_the_duality_gap_may_have_as_many_newton_millimetres_as_the_tolerance_has_mm() -> None:
    given, load = opened("three-part-stack")
    units = Units.of(given).of_loads([load])
    scaled_load = units.load(load)
    assert scaled_load.energy == units.U**2 > 1
    assert replace(units, length=1e200 * units.delta).load(load).energy == np.inf  # and no error
    assert gap_tolerance(1e-6, scaled_load) == 1e-6 / units.U**2
    assert gap_tolerance(1e-10, scaled_load) == 1e-13  # rounding
    assert gap_tolerance(1e-300, scaled_load) == 1e-300  # asked for more than that
    assert gap_tolerance(1e-9, replace(scaled_load, energy=1e-6)) == 1e-9
    larger = Units.of(given).of_loads([replace(load, f=2.0**12 * load.f, g=2.0**12 * load.g)])
    assert larger.length > 1
    assert gap_tolerance(1.0 / larger.length, larger.load(load)) == 1.0 / larger.U**2 > 1e-13


# Answers.


def test_the_condition_is_that_of_the_problem_in_its_units() -> None:
    """The springs of a sparse K are as stiff as it allows: a diagonal has the condition 1 or 2."""
    n = 40
    K = Stiffness.of(sp.csc_array(sp.diags_array(np.exp2(np.arange(n)))))
    data = Prepared(Assembly(K, sp.eye_array(n, format="csc")))
    session = opened_session("newton", problem_in(data, "sparse"), 1e-10)
    assert (session.units.D != 1).any()
    assert session.units.scaled().prepared.condition <= 2


@pytest.mark.parametrize(
    ("name", "form", "bits"),
    [
        *((name, form, 0) for name, form in CASES if name not in SLOW),
        *((name, form, 20) for name, form in CASES if name not in SLOW and form == "sparse"),
    ],
)
def test_answers_do_not_depend_on_units(name: str, form: Form, bits: int) -> None:
    """Contacts of any unit, cold, warm and in a batch: the same to the last bit. In the sparse form
    unknowns of any unit as well: as good, for a tolerance in mm then means something else.
    """
    base = make_prepared(2, 12, 3)
    case, _ = make_load(3, base)
    x, lam = solve_by_nnls(base, case)
    n, m = base.assembly.n, base.assembly.m
    S, C = powers(4, n, bits), powers(5, m, 40)
    answers: list[list[Answer]] = []
    for data, given in ((base, case), rescaled(base, case, S, C)):
        problem = problem_in(data, form)
        session = opened_session(name, problem, TOLERANCES.get(name, 1e-10))
        first, other = problem.loads([given, LoadCase(given.f, 1.0625 * given.g)])
        in_turn = [session.next(first, None), session.next(other, session.nearest(other))]
        in_turn.append(session.next(first, session.nearest(first)))
        if session.batch is not None:
            in_turn += session.solve_batch([first, first])
        answers.append(in_turn)
    rounded = bits > 0 or name == "proxqp"  # whose rounding depends on where its arrays lie in memory
    for one, two in zip(*answers, strict=True):
        assert one.status == two.status
        np.testing.assert_allclose(two.lam * C, one.lam, rtol=0, atol=1e-5 if rounded else 0)
        if one.x is not None and two.x is not None:
            np.testing.assert_allclose(two.x * S, one.x, rtol=0, atol=1e-8 if rounded else 0)
    np.testing.assert_allclose(answers[0][0].lam, lam, rtol=0, atol=1e-3)
    if answers[0][0].x is not None:
        np.testing.assert_allclose(answers[0][0].x, x, rtol=0, atol=1e-7)


@pytest.mark.parametrize("far", [1e10, 1e30])
@pytest.mark.parametrize(("name", "form"), [*IN_HOUSE, *((name, "dual") for name in WRITTEN_HERE)])
def test_a_contact_out_of_reach_changes_no_answer(name: str, form: Form, far: float) -> None:
    """All contacts that stay open are moved away: λ and x are those of the contacts as they were."""
    data = make_prepared(2, 12, 3)
    case, _ = make_load(3, data)
    x, lam = solve_by_nnls(data, case)
    moved = LoadCase(case.f, np.where(lam > 0, case.g, far))
    assert 0 < np.count_nonzero(lam) < len(lam)
    problem = problem_in(data, form)
    (load,) = problem.loads([moved])
    assert Units.of(problem).of_loads([load]).length == 1.0
    answer = opened_session(name, problem, TOLERANCES[name]).cold(load)
    assert answer.status == "solved" or (name, far) == ("ipm", 1e30)  # which starts from all gaps, and stalls
    if answer.status == "solved":
        np.testing.assert_allclose(answer.lam, lam, rtol=0, atol=1e-4)
        np.testing.assert_allclose(problem.recover([answer.lam], [answer.x], [load])[0], x, rtol=0, atol=1e-7)


@pytest.mark.parametrize(
    ("name", "scene", "limit_mm"),
    [
        *((name, "heavy-sheet-on-tool", 1e-8) for name in TAKEN),
        # HiGHS's active-set method keeps a dense matrix of the order of the free unknowns, at most 4000.
        *((name, "three-part-stack", 1e-6) for name in TAKEN if ASKED and name != "highs"),
    ],
)
def test_a_library_solves_the_finite_element_model(name: str, scene: str, limit_mm: float) -> None:
    problem, load = opened(scene)
    x, lam = certified(scene)
    assert 0 < np.count_nonzero(lam) < len(lam)
    answer = opened_session(name, problem, 1e-9).cold(load)
    assert answer.status == "solved"
    np.testing.assert_allclose(problem.assembly.at_junction(answer.x), x, rtol=0, atol=limit_mm)
    assert answer.lam.sum() == pytest.approx(lam.sum(), rel=1e-6)
