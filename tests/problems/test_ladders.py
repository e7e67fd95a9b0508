"""The ladders: their answers are exact, what cannot be taken is refused, and the in-house solvers hold. At
full size: as exact, made when needed only, and all in the suite.
"""

from functools import cache

import numpy as np
import pytest
import scipy.linalg as sla
from exact_answer import is_exact
from sample_size import tried
from small_problems import problem_in

from harness.planning.plan import expand
from harness.planning.suite import read_suite
from harness.solving.solver_session import SolverSession
from harness.verification.judge import judge
from harness.verification.reference import best_of_candidates
from harness.verification.reference_problem import ReferenceProblem, measurable
from problems.build import prepared
from problems.errors import InputError
from problems.ladders import make_rung, rung_names
from problems.ladders.manufactured import contacts, exact_assembly, spectrum, two_parts
from problems.model.scene import ManufacturedProblem, ManufacturedScene
from problems.scene_files import read_scene, scene_names
from solvers.base import Answer, Form
from solvers.registry import make_solver

RUNGS = rung_names("hard/")
TAKEN = [name for name in RUNGS if not make_rung(name).refused]
REFUSED = [name for name in RUNGS if make_rung(name).refused]
EXACT = [
    name
    for name in TAKEN
    if isinstance(made := make_rung(name), ManufacturedScene) and made.made.x is not None
]
IN_HOUSE: list[tuple[str, Form, float]] = [
    ("ipm", "dual", 1e-14),
    ("gi", "dual", 1e-10),
    ("gi", "primal", 1e-10),
    ("newton", "dual", 1e-10),
    ("ipm-fast", "dual", 1e-10),
    ("mprgp", "dual", 1e-10),
]
GATED = {("newton", "dual"), ("ipm-fast", "dual"), ("ipm", "dual"), ("gi", "dual"), ("gi", "primal")}
#: Where the paper's interior-point method, which starts from forces of 1 N, may say that it finds no answer.
MAY_GIVE_UP = [("ipm", name) for name in TAKEN if name.endswith("/chain-32")]


@cache
def opened(name: str) -> ReferenceProblem:
    return measurable(name)


def made_of(name: str) -> ManufacturedProblem:
    scene = make_rung(name)
    return scene.made


def test_there_are_enough_rungs_and_none_twice() -> None:
    assert len(TAKEN) >= 60
    assert len({read_scene(name).key for name in RUNGS}) == len(RUNGS)
    assert not set(RUNGS) & set(scene_names())


@pytest.mark.parametrize("name", EXACT)
def test_the_answer_satisfies_the_optimality_conditions_without_rounding(name: str) -> None:
    assert is_exact(made_of(name))


@pytest.mark.parametrize("percent", [5, 10, 25, 50, 75, 100])
def test_the_share_of_contacts_without_a_force_is_as_named(percent: int) -> None:
    made = made_of(f"hard/degeneracy/{percent:03d}")
    y = made.load.g - made.assembly.A.T @ made.x
    weak = np.count_nonzero((made.lam == 0) & (y == 0))
    assert weak == round(percent / 100 * made.assembly.m)


def test_cond_grows_along_the_ladders_that_say_so() -> None:
    for ladder in ("conditioning", "coincident", "thickness", "refinement", "together"):
        names = [name for name in TAKEN if f"/{ladder}/" in name]
        conditions = [opened(name).prepared.facts["cond_K"] for name in names]
        assert conditions == sorted(conditions)  # type: ignore[type-var]
        assert len(names) >= 4
        if ladder == "conditioning":
            assert conditions == pytest.approx([float(name.rpartition("/")[2]) for name in names], rel=0.05)


@pytest.mark.parametrize("name", REFUSED)
def test_what_the_model_cannot_take_is_refused_in_words(name: str) -> None:
    scene = read_scene(name)
    with pytest.raises(InputError) as error:
        _ = prepared(scene).Q
    assert scene.refused in str(error.value)
    assert name in str(error.value)


@pytest.mark.parametrize("name", EXACT)
def test_the_refined_reference_finds_the_exact_answer(name: str) -> None:
    """Two independent ways to the truth; beyond cond(K) = 1e13 no bound is proven any more."""
    base = opened(name)
    found = best_of_candidates(base.prepared, base.load)
    assert base.reference.bound_mm == 0.0
    assert abs(found.x - base.reference.x).max() <= found.bound_mm
    assert np.isfinite(found.bound_mm) or base.prepared.facts["cond_K"] > 2e13  # type: ignore[operator]


@pytest.mark.parametrize("name", sorted({*TAKEN} - {*EXACT}))
def test_a_rung_without_an_exact_answer_can_be_judged(name: str) -> None:
    base = opened(name)
    assert base.reference.bound_mm <= 0.1 * base.limit_mm(1e-7)


def judged(name: str, solver: str, form: Form, tolerance: float) -> tuple[Answer, str]:
    """The answer on a rung and its verdict."""
    base = opened(name)
    data, case = base.prepared, base.load
    session = SolverSession(make_solver(solver, {}), problem_in(data, form), tolerance)
    session.open()
    answer = session.next(data.with_p([case])[0], None)
    assert np.isfinite(answer.lam).all()
    x = answer.x if answer.x is not None else data.recover(answer.lam, case)
    return answer, judge(data, case, base.reference, x, answer.lam, base.limit_mm(1e-7)).verdict


@pytest.mark.parametrize(("name", "solver", "form", "tolerance"), tried(TAKEN, IN_HOUSE), ids=str)
def test_in_house_solvers_hold(name: str, solver: str, form: Form, tolerance: float) -> None:
    """Up to cond(K) = 1e12 within what conditioning allows; beyond it, or else a status that says so."""
    answer, verdict = judged(name, solver, form, tolerance)
    cond = opened(name).prepared.facts["cond_K"]
    hard = cond > 1.2e12 or (solver, name) in MAY_GIVE_UP  # type: ignore[operator]
    assert verdict == "within" or (hard and answer.status != "solved")
    assert answer.status == "solved" or answer.details["cause"]


def test_the_suite_measures_every_rung_with_every_solver() -> None:
    """Ours in each form; a library in one form, in its other on whole ladders, of which it fails on some."""
    suite = read_suite("hard")
    plan = expand(suite)
    assert {m.scene for m in plan} == set(TAKEN)
    assert {m.tolerance for m in plan if m.solver == "projected-gauss-seidel"} == {1e-10, 1e-14}
    plan = [m for m in plan if (m.solver, m.tolerance) != ("projected-gauss-seidel", 1e-10)]
    lines = {(m.solver, m.form) for m in plan}
    taken = {line: {m.scene for m in plan if (m.solver, m.form) == line} for line in lines}
    whole = {line for line, scenes in taken.items() if scenes == set(TAKEN)}
    assert {solver for solver, _ in whole} == {solver for solver, _ in lines}
    assert {line for line in lines - whole if line[0] in ("ipm", "gi", "newton", "ipm-fast")} == set()
    assert {m.solver for m in plan if m.entry.gated} == {"ipm", "gi", "newton", "ipm-fast"}


@pytest.mark.parametrize("m", [8, 16, 24, 32])
def test_the_chain_takes_quadratically_many_exchanges(m: int) -> None:
    base = opened(f"hard/pivoting/chain-{m:02d}")
    gi, problem = make_solver("gi", {}), problem_in(base.prepared, "primal")
    answer = gi.solve(gi.setup(gi.prepare(gi.convert(problem)), base.load, 1e-10), base.load, 1e-10)
    assert answer.iterations == m**2 // 4 + 4


@pytest.mark.parametrize("n", [16, 64, 256])
def test_all_contacts_of_a_vertex_touch_and_a_third_have_a_force(n: int) -> None:
    made = made_of(f"hard/pivoting/vertex-{n:03d}")
    assert made.assembly.A.shape == (n, n)
    assert not (made.load.g - made.assembly.A.T @ made.x).any()
    assert np.count_nonzero(made.lam) == round(n / 3)


# --- at full size ---------------------------------------------------------------------------------------

FULL = rung_names("hard-full/")
N = 300  # unknowns per part: 256 + 32 + 8 + 4
SMALL = {
    "25 % weak": two_parts(N, 1e6, seed=2, closed=0.4, weak=0.25),
    "100 % weak": two_parts(N, 1e6, seed=2, closed=0.0, weak=1.0),
    "cond 1e12": two_parts(N, 1e12, seed=2),
    "2^-16 apart": two_parts(N, 1e4, seed=3, A=contacts(N, 128, 2.0**-16)),
}


@pytest.mark.parametrize("name", SMALL)
def test_an_answer_as_of_the_full_size_is_exact(name: str) -> None:
    assert is_exact(SMALL[name])


def test_the_spectrum_is_exact_for_every_size_and_that_of_hadamard_for_a_power_of_two() -> None:
    for n in (1, 22, 64):
        d = spectrum(n, 1e4)
        K, _ = exact_assembly(d, d).K.matrices
        np.testing.assert_allclose(np.linalg.eigvalsh(K), 64 * np.sort(d), rtol=1e-9)
    H = sla.hadamard(64, dtype=float)
    np.testing.assert_array_equal(K, (H * d) @ H)  # 64 = the stiffness of the grid's smallest eigenvalue


def test_nothing_is_made_before_it_is_needed_and_one_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def make(name: str) -> ManufacturedProblem:
        made.append(name)
        return SMALL["25 % weak"]

    for name in FULL:
        scene = make_rung(name)
        if isinstance(scene, ManufacturedScene):
            monkeypatch.setitem(vars(scene), "make", lambda name=name: make(name))
    expand(read_suite("hard-full"))
    assert not made
    first, second = read_scene("hard-full/degeneracy/4386-025"), read_scene("hard-full/degeneracy/4386-050")
    for scene in (first, first, second, second, first):
        _ = scene.made  # type: ignore[attr-defined]
    assert made == [first.name, second.name, first.name]


def test_the_suite_at_full_size_measures_every_rung_with_every_solver_of_ours() -> None:
    suite = read_suite("hard-full")
    plan = expand(suite)
    assert {m.scene for m in plan} == set(FULL)
    for name in FULL:
        ours = {(m.solver, m.form) for m in plan if m.scene == name and m.entry.gated}
        assert ours == GATED - ({("gi", "primal")} if "/11308-" in name else set())
