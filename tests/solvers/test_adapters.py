from typing import Any

import numpy as np
import piqp
import pytest
import qpsolvers
import scipy.sparse as sp
from proxsuite import proxqp
from small_problems import make_load, make_prepared, make_strips, problem_in, solve_by_nnls
from solver_forms import CASES, TESTED

from harness.conformance.check import run
from harness.solving.solver_session import SolverSession
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness
from solvers.adapter import clipped
from solvers.base import DENSE_FORMS, FORMS, Answer, Form
from solvers.libraries.proxqp import ProxQp
from solvers.libraries.qpsolvers import TIME_LIMIT, TOLERANCE
from solvers.registry import make_solver

VARIANTS: list[tuple[str, dict[str, Any], tuple[Form, ...]]] = [
    *((name, {}, FORMS) for name in TESTED),
    ("clarabel", {"direct_solve_method": "qdldl"}, FORMS),
    ("proxqp", {"backend": "primal_ldlt"}, DENSE_FORMS),
    ("proxqp", {"backend": "primal_dual_ldlt"}, DENSE_FORMS),
    ("piqp", {"backend": "sparse"}, DENSE_FORMS),  # which the sparse form takes anyway
    ("cvxpy", {"via": "CLARABEL"}, ("dual",)),  # after the model, which is compiled alike
]


@pytest.mark.parametrize(("name", "options", "forms"), VARIANTS, ids=str)
def test_conformance(name: str, options: dict[str, Any], forms: tuple[Form, ...]) -> None:
    assert [str(finding) for finding in run(lambda: make_solver(name, options), forms)] == []


def solved(
    name: str,
    options: dict[str, Any],
    prepared: Prepared,
    load: LoadCase,
    tolerance: float,
    form: Form = "dual",
) -> Answer:
    """As the library gives it: in the units of the problem, without a session."""
    solver = make_solver(name, options)
    ready = solver.setup(solver.convert(problem_in(prepared, form)), load, tolerance)
    return solver.solve(ready, load, tolerance)


# Tolerances and settings that really reach the library.


def library_of(solver: Any, form: Form, tolerance: float) -> Any:
    prepared = make_prepared(9, 4)
    _, load = make_load(10, prepared)
    session = SolverSession(solver, problem_in(prepared, form), tolerance)
    session.open()
    session.cold(load)
    return session.ready[1]


#: What is asked for the duality gap: τ N·mm; in the sparse form τ/U², and U is 128 (N·mm)^½ in library_of.
GAP: dict[Form, float] = {"primal": 3e-7, "dual": 3e-7, "sparse": 3e-7 / 128**2}


#: By solver and option, what its library then holds; GAP for what is asked of the duality gap.
ABSOLUTE = {"eps_abs": 3e-7, "eps_rel": 0.0}
PROXIMAL = ABSOLUTE | {"check_duality_gap": True, "eps_duality_gap_abs": "GAP", "eps_duality_gap_rel": 0.0}
HELD: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "osqp": (
        {"polishing": True},
        ABSOLUTE | {"check_dualgap": 1, "polishing": 1, "adaptive_rho": 1, "adaptive_rho_interval": 50},
    ),
    "clarabel": (
        {"direct_solve_method": "qdldl"},
        {"tol_feas": 3e-7, "tol_gap_abs": "GAP", "tol_gap_rel": 0.0, "direct_solve_method": "qdldl"},
    ),
    "proxqp": ({}, PROXIMAL),
    "piqp": ({}, PROXIMAL),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", HELD)
def test_settings_that_a_library_holds(name: str, form: Form) -> None:
    options, wanted = HELD[name]
    library = library_of(make_solver(name, options), form, 3e-7)
    settings = library.get_settings() if name == "clarabel" else library.settings
    held = {key: GAP[form] if value == "GAP" else value for key, value in wanted.items()}
    assert {key: getattr(settings, key) for key in held} == held
    if name == "clarabel":
        assert settings.equilibrate_enable is (form != "dual")
        assert settings.max_threads == 0  # the environment decides
    if name == "piqp":
        assert isinstance(library, piqp.SparseSolver if form == "sparse" else piqp.DenseSolver)
    if name == "proxqp":
        assert isinstance(library, proxqp.sparse.QP) is (form == "sparse")


#: One contact, K = 100 N/mm: (f, g, x, λ) of a case in mm, and of one 10⁵ times as large.
SMALL, LARGE = (50.0, 0.2, 0.2, 30.0), (5e6, 2e4, 2e4, 3e6)


@pytest.mark.parametrize("cases", [(SMALL, LARGE), (LARGE, SMALL)], ids=["larger", "smaller"])
@pytest.mark.parametrize(("name", "form"), CASES)
def test_a_case_of_another_size_has_a_tolerance_of_its_own(name: str, form: Form, cases: Any) -> None:
    """Solved after another case, it is as accurate as by itself; the unit of length changes between them."""
    data = Prepared(Assembly(Stiffness.of(np.array([[100.0]])), sp.csc_array([[1.0]])))
    problem = problem_in(data, form)
    loads = problem.loads([LoadCase(np.array([f]), np.array([g])) for f, g, *_ in cases])
    alone, series = (SolverSession(make_solver(name, {}), problem, 1e-7) for _ in range(2))
    for session in (alone, series):
        session.open()
    first = series.next(loads[0], None)
    length, wanted = series.units.length, alone.next(loads[1], None)
    answer = series.next(loads[1], series.nearest(loads[1]))
    assert first.status == "solved"
    assert series.units.length == alone.units.length != length
    assert answer.status == wanted.status
    exact = cases[1][3]
    assert abs(answer.lam[0] - exact) <= 2 * abs(wanted.lam[0] - exact) + 1e-5
    if name in HELD:
        library = series.ready[1]
        settings = library.get_settings() if name == "clarabel" else library.settings
        key = "tol_feas" if name == "clarabel" else "eps_abs"
        assert getattr(settings, key) == 1e-7 / series.units.length


@pytest.mark.parametrize("form", DENSE_FORMS)
def test_proxqp_takes_bounds_as_a_box_and_the_backend_that_is_chosen(form: Form) -> None:
    library = library_of(ProxQp(backend="primal_ldlt"), form, 3e-7)
    assert library.is_box_constrained() is (form == "dual")
    assert library.which_dense_backend().name == "PrimalLDLT"


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", ["osqp", "proxqp"])
def test_a_warm_start_is_taken(name: str, form: Form) -> None:
    """From its own answer a case takes fewer iterations than from the answer of another."""
    prepared, taken = make_prepared(4, 30, 5), []
    loads = [make_load(seed, prepared)[1] for seed in (5, 6)]
    for near in loads:
        session = SolverSession(make_solver(name, {}), problem_in(prepared, form), 1e-9)
        session.open()
        session.next(near, None)
        answer = session.next(loads[0], session.nearest(loads[0]))
        taken.append(answer.inner_iterations or answer.iterations)
    assert taken[0] < taken[1]


@pytest.mark.parametrize("name", sorted(set(TOLERANCE) & set(TESTED)))
def test_tolerance_reaches_qpsolvers(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: dict[str, Any] = {}
    original = qpsolvers.solve_problem

    def spy(problem: Any, solver: str, **settings: Any) -> Any:
        seen.update(settings)
        return original(problem, solver, **settings)

    monkeypatch.setattr(qpsolvers, "solve_problem", spy)
    prepared = make_prepared(12, 4)
    _, load = make_load(13, prepared)
    got = solved(name, {}, prepared, load, 3e-7)
    assert 3e-7 in seen.values()
    assert "tolerance" not in got.details


def test_a_solver_that_takes_no_tolerance_says_so() -> None:
    prepared = make_prepared(12, 4)
    answer = solved("quadprog", {}, prepared, make_load(13, prepared)[1], 1e-9, "primal")
    assert answer.details["tolerance"] == "not taken"


def test_highs_accepts_the_settings_it_is_given() -> None:
    import highspy

    library = highspy.Highs()
    library.setOptionValue("log_to_console", False)
    for key, value in TOLERANCE["highs"](1e-12, 1e-12).items():
        assert library.setOptionValue(key, value) == highspy.HighsStatus.kOk, key


# What the adapters share.


def test_small_negative_multipliers_become_zero_and_what_is_not_finite_is_no_answer() -> None:
    lam = np.array([1.0, -1e-10, -1e-3])
    got = clipped(Answer("solved", lam), 1e-9)
    assert got.lam.tolist() == [1.0, 0.0, -1e-3]
    assert lam[1] == -1e-10  # the library's own array is left alone
    assert clipped(Answer("solved", np.array([1.0, np.nan])), 1e-9).status == "failed"
    assert clipped(Answer("solved", np.ones(2), np.array([np.inf])), 1e-9).lam is None


@pytest.mark.parametrize("name", ["piqp", "clarabel"])
def test_a_stopped_solver_does_not_say_solved(name: str) -> None:
    """A tolerance below rounding cannot be met: whatever the library does, it is not called solved."""
    prepared = make_strips(40)
    _, load = make_load(15, prepared)
    assert solved(name, {}, prepared, load, 1e-300, "primal").status != "solved"


@pytest.mark.parametrize("form", DENSE_FORMS)
@pytest.mark.parametrize("name", sorted({"osqp", "clarabel", *TIME_LIMIT} & set(TESTED)))
def test_out_of_time_it_gives_its_last_iterate(name: str, form: Form) -> None:
    prepared = make_strips(100)
    case, load = make_load(3, prepared, force=50.0)
    solver, given = make_solver(name, {}), load if form == "dual" else case
    solver.time_limit_s = 1e-6
    ready = solver.setup(solver.convert(problem_in(prepared, form)), given, 1e-12)
    answer = solver.solve(ready, given, 1e-12)
    assert answer.status != "solved"
    assert answer.lam is not None
    assert (answer.x is None) is (form == "dual")


def test_polish_accepted_outside_the_tolerance_is_not_solved() -> None:
    """OSQP says solved here with a dual residual of 4e-7 at a tolerance of 1e-9."""
    prepared = make_strips(40)
    case, load = make_load(3, prepared)
    expected_x, _ = solve_by_nnls(prepared, case)
    plain, polished = (solved("osqp", {"polishing": on}, prepared, load, 1e-9) for on in (False, True))
    assert polished.details == {"status": "solved", "polish": "accepted"}
    assert np.abs(prepared.recover(polished.lam, case) - expected_x).max() > 1e-7
    assert polished.status == "inaccurate"
    assert plain.status == "solved"
    modelled = solved("cvxpy", {}, prepared, load, 1e-9)  # polishing is CVXPY's default
    assert np.abs(prepared.recover(modelled.lam, case) - expected_x).max() > 1e-7
    assert modelled.status == "inaccurate"


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("osqp", {"scaling": 0}),
        ("clarabel", {"equilibrate_enable": True}),
        ("piqp", {"preconditioner_scale_cost": True}),
        ("proxqp", {"default_rho": 1e-8}),
        ("scs", {"scale": 0.5}),
    ],
    ids=str,
)
def test_a_librarys_own_settings_are_handed_on(name: str, options: dict[str, Any]) -> None:
    """They change the iterates, not the answer."""
    prepared = make_prepared(2, 20, 5)
    _, load = make_load(3, prepared)
    usual, own = (solved(name, given, prepared, load, 1e-9) for given in ({}, options))
    assert (usual.lam != own.lam).any()
    np.testing.assert_allclose(own.lam, usual.lam, rtol=1e-5, atol=1e-5)
