"""`newton` and `mprgp` on the sparse form, where a product with Q is a solution with K's factors."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from matrix_files import write_mtx
from scipy.optimize import isotonic_regression
from scipy.spatial import KDTree
from small_problems import make_load, make_prepared, make_strips, problem_in, solve_by_nnls
from sparse_matrices import band_matrix, graph_matrix, symmetric

from harness.solving.solver_session import SolverSession
from harness.verification.reference import best_of_candidates, proof_of, reference
from harness.verification.reference_problem import last_stage
from problems.build import load_case, prepared
from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.ladders.sparse import convex, monotone
from problems.scene_files import read_scene, scene_names
from problems.stiffness.banded_block import BandedBlock
from problems.stiffness.operator import Stiffness
from problems.stiffness.sparse_block import GeneralBlock
from solvers.algorithms.block_pivoting import TrialSolution
from solvers.algorithms.contact_sets import ContactSprings
from solvers.base import Answer
from solvers.kkt import with_x
from solvers.registry import make_solver

LIMIT_MM = 1e-7 / 4
GALLERY = [
    name
    for name in scene_names()
    if name.startswith("gallery/") and (read_scene(name).expected_size or (0, 0))[1] > 0
    if name != "gallery/riveted-from-one-end"  # in another order: the same K
]


def session_of(name: str, data: Prepared, **options: Any) -> SolverSession:
    made = SolverSession(make_solver(name, options), problem_in(data, "sparse"), 1e-10)
    made.open(batched=name == "newton")
    return made


def check(answer: Answer, dense: Prepared, load: LoadCase) -> Vector:
    """x by non-negative least squares, which the answer has."""
    x, lam = solve_by_nnls(dense, load)
    assert 0 < np.count_nonzero(lam) < len(lam)
    assert answer.status == "solved"
    np.testing.assert_allclose(answer.x, x, rtol=0, atol=LIMIT_MM)
    np.testing.assert_allclose(answer.lam, lam, rtol=0, atol=1e-5 * max(1.0, lam.max()))
    return x


@pytest.mark.parametrize("name", GALLERY)
def test_a_scene_of_the_gallery(name: str) -> None:
    """Against the certified reference of the condensed matrices, whose code is another throughout."""
    scene, _ = last_stage(read_scene(name))
    exact = reference(prepared(scene), load_case(scene))
    data, load = prepared(scene, form="sparse"), load_case(scene, "sparse")
    for solver in ("newton", "mprgp"):
        answer = session_of(solver, data).next(load, None)
        assert answer.status == "solved"
        assert abs(data.assembly.at_junction(np.asarray(answer.x)) - exact.x).max() <= LIMIT_MM
        out_of_balance = data.assembly.K.multiply(answer.x) + data.assembly.A @ answer.lam - load.f
        assert abs(out_of_balance).max() <= 1e-9 * data.assembly.K.norm * abs(np.asarray(answer.x)).max()
        closed = (np.asarray(answer.lam) > 0).sum()
        assert closed == pytest.approx(exact.active.sum(), abs=2)  # weakly active ones


def banded(seed: int) -> Prepared:
    """Two parts of a band each, a contact on one to two unknowns of both at every third."""
    random, n = np.random.default_rng(seed), 90
    blocks = tuple(band_matrix(random, n, 4) for _ in range(2))
    normals = sp.csc_array(sp.eye_array(n) + 0.5 * sp.eye_array(n, k=1))[:, ::3]
    return Prepared(
        Assembly(Stiffness.of(*(K.toarray() for K in blocks)), sp.csc_array(sp.vstack([normals, -normals])))
    )


SMALL = [make_prepared(1, 12), make_prepared(2, 20, 5), make_strips(150), banded(3), banded(4)]


@pytest.mark.parametrize("dense", SMALL)
def test_without_m_the_sets_are_solved_by_factorisations_of_k(
    dense: Prepared, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Stiffness, "local_compliance", lambda *_: None)
    load, _ = make_load(6, dense)
    data = Prepared(replace(dense.assembly, K=dense.assembly.K.as_sparse()))
    assert data.approximate_inverse.M is None
    for solver in ("newton", "mprgp"):  # the latter takes Q⁻¹
        check(session_of(solver, data).next(load, None), dense, load)


@pytest.mark.parametrize(("dense", "n", "most"), [(False, 1000, 60), (True, 500, 100)])
def test_an_edge_of_contact_does_not_creep(dense: bool, n: int, most: int) -> None:
    """Convex regression: pivoting alone takes hundreds of sets, an interior point some thirty factors."""
    random = np.random.default_rng(0)
    A = sp.csc_array(sp.diags_array([-1.0, 2.0, -1.0], offsets=[0, -1, -2], shape=(n, n - 2)))
    f = np.sin(np.arange(n) / 300) + 0.1 * random.standard_normal(n)
    data = Prepared(Assembly(Stiffness.of(np.eye(n) if dense else sp.eye_array(n, format="csc")), A))
    answer = session_of("newton", data).next(LoadCase(f, np.zeros(n - 2)), None)
    assert answer.status == "solved"
    assert answer.inner_iterations is not None
    assert answer.inner_iterations <= most
    lam = np.asarray(answer.lam)
    x = f - A @ lam
    assert (A.T @ x).max() <= 1e-9  # convex
    assert lam.min() >= 0
    assert abs(lam @ (A.T @ x)) <= 1e-6
    assert abs(x + A @ lam - f).max() <= 1e-6


def test_forces_whose_rounding_is_above_the_tolerance() -> None:
    """Convex regression of 10 000 unknowns: an ulp of λ moves gaps by 1e-10 mm. That is solved, and proven;
    forces off by a relative 1e-13 are not."""
    made = convex(10_000, 0.3, 1).made
    assert made is not None
    data, load = Prepared(made.assembly), made.load
    answer = session_of("newton", data).next(load, None)
    lam = np.asarray(answer.lam)
    assert answer.status == "solved"
    assert lam.max() > 1e5
    assert answer.details["kkt_residual_mm"] > 1e-10
    (proven,) = proof_of(data).proven([load], [lam])
    assert abs(answer.x - proven.x.hi).max() <= 1e-8
    assert proven.bound_mm <= 1e-14
    off = replace(answer, lam=lam * (1 + 1e-13 * np.random.default_rng(0).standard_normal(len(lam))))
    assert with_x(problem_in(data, "sparse"), [off], [load], 1e-10)[0].status == "inaccurate"


@pytest.mark.parametrize(("length", "status"), [(1.0, "solved"), (2.0, "inaccurate")])
def test_what_may_be_rounding_is_so_in_mm(length: float, status: str) -> None:
    """y = 2⁻²⁴ is an ulp of g = −2²⁸ and 0.6e-7 of a unit of length, which is 1 mm or 2 mm."""
    data = Prepared(Assembly(Stiffness.of(sp.csc_array([[1.0]])), sp.csc_array([[1.0]])))
    load = LoadCase(np.zeros(1), np.array([-(2.0**28)]), length=length)
    off = Answer("inaccurate", np.array([2.0**28 + 2.0**-24]))
    (answer,) = with_x(problem_in(data, "sparse"), [off], [load], 1e-10)
    assert (answer.status, answer.details["kkt_residual_mm"]) == (status, 2.0**-24)


@pytest.mark.parametrize(
    ("n", "seed", "difficulty"), [(500, 1009, 19 / 24), (500, 1011, 23 / 24), (3000, 1005, 11 / 16)]
)
def test_sets_end_soon_where_contacts_depend_on_one_another(n: int, seed: int, difficulty: float) -> None:
    """An interior point that went on into rounding left sets that took a hundred more, or did not end."""
    made = monotone(n, difficulty, seed).made
    assert made is not None
    answer = session_of("newton", Prepared(made.assembly)).next(made.load, None)
    assert answer.status == "solved"
    assert (answer.inner_iterations or 0) <= 40


def test_a_set_of_contacts_that_contradict_one_another() -> None:
    """A contact stands twice with two gaps, which no force closes: none is made, and the answer keeps the
    smaller gap."""
    K, A = sp.csc_array(2.0 * sp.eye_array(3)), sp.csc_array(np.eye(3)[:, [0, 0, 1]])
    data, y = Prepared(Assembly(Stiffness.of(K), A)), np.array([-0.1, 0.1, 0.0])
    closed = ContactSprings(data).set(TrialSolution(np.zeros(3), y, 0.0), np.ones(3, dtype=bool))
    assert abs(A @ closed.lam).max() <= 1e-12
    load = LoadCase(2 * np.ones(3), np.array([0.1, 0.3, 0.2]))
    answer = session_of("newton", data).next(load, None)
    np.testing.assert_allclose(answer.x, [0.1, 0.2, 1.0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("with_nodes", [False, True])
@pytest.mark.parametrize("band", [True, False])
def test_a_users_own_sparse_matrices(band: bool, with_nodes: bool, tmp_path: Path) -> None:
    """K in Matrix Market files, a contact on any unknowns; no grid, in one case no band."""
    random, n, m = np.random.default_rng(7), 800, 40
    K = band_matrix(random, n, 3) if band else graph_matrix(random, n)
    unit = sp.eye_array(n, format="csc")
    ends = random.permutation(n)
    A = sp.csc_array(unit[:, ends[:m]] - unit[:, ends[m : 2 * m]])
    f, g = random.normal(0, 1, n), random.uniform(-0.1, 0.3, m)
    if with_nodes:
        path = tmp_path / "own.npz"
        np.savez(path, K=K.toarray(), A=A.toarray(), f=f, g=g, nodes=random.uniform(0, 100, (n, 2)))
    else:
        path = write_mtx(tmp_path, K=K, A=A, f=f, g=g)
    scene = read_scene(str(path))
    data = prepared(scene, form="sparse")
    assert not data.assembly.K.dense
    load = load_case(scene, "sparse")
    dense = Prepared(Assembly(Stiffness.of(K.toarray(order="F")), A))
    session = session_of("newton", data)
    x = check(session.next(load, None), dense, load)
    assert isinstance(data.assembly.K.blocks[0], BandedBlock if band else GeneralBlock)
    found = best_of_candidates(data, load)
    assert abs(found.x - x).max() <= found.bound_mm + 1e-11
    assert found.bound_mm <= 1e-12
    again = replace(load, g=load.g + 0.01)
    check(session.next(again, session.nearest(again)), dense, again)


@pytest.mark.parametrize("kind", ["band", "face", "none"])
def test_each_preconditioner_cold_and_warm(kind: str) -> None:
    dense = make_strips(150)
    data = Prepared(replace(dense.assembly, K=dense.assembly.K.as_sparse()))
    first, _ = make_load(3, dense)
    second = LoadCase(first.f * 1.02, first.g)
    session = session_of("mprgp", data, preconditioner=kind)
    check(session.next(first, None), dense, first)
    warm = session.next(second, session.nearest(second))
    check(warm, dense, second)
    again = session_of("mprgp", data, preconditioner=kind).next(second, None)
    assert warm.details["products"] <= again.details["products"]


def test_the_smallest_joint_of_the_scaling_in_a_few_products() -> None:
    scene = read_scene("scaling/1170")
    data, load = prepared(scene, form="sparse"), load_case(scene, "sparse")
    answer = session_of("mprgp", data).next(load, None)
    assert answer.status == "solved"
    assert answer.details["products"] <= 20


def test_no_m_whose_factors_cost_more_than_those_of_k() -> None:
    """An obstacle under every second node of a random graph in the plane, a few of them touched: M took
    twenty times as long as all sets with springs."""
    random = np.random.default_rng(1)
    near = KDTree(places := random.random((1500, 2))).query(places, 7)[1]
    ends = np.repeat(near[:, 0], 6), near[:, 1:].ravel()
    K = symmetric(random, *ends, 1500)
    A = sp.eye_array(1500, format="csc")[:, ::2]
    data, load = Prepared(Assembly(Stiffness.of(K), A)), LoadCase(random.normal(size=1500), np.full(750, 0.2))
    answer = session_of("newton", data).next(load, None)
    assert data.approximate_inverse.M is None
    check(answer, Prepared(Assembly(Stiffness.of(K.toarray()), A)), load)


def test_contacts_all_over_an_area_are_refused_with_the_reason() -> None:
    """For them M would take longer than some factorisations of K; newton solves them with those."""
    scene = read_scene("outside/obstacle/80")
    data, load = prepared(scene, form="sparse"), load_case(scene, "sparse")
    assert data.approximate_inverse.M is None
    answer = session_of("mprgp", data).next(load, None)
    assert (answer.status, answer.lam) == ("failed", None)
    assert "all over an area" in answer.details["cause"]


@pytest.mark.parametrize("order", [1, 2])
def test_separate_unknowns_settle_in_a_few_products(order: int) -> None:
    """Isotonic and convex regression, too many contacts for M = Q⁻¹. Against pool adjacent violators, and by
    the optimality conditions."""
    n = 4000
    f = np.sin(np.arange(n) / 300) + 0.1 * np.random.default_rng(0).standard_normal(n)
    A = sp.eye_array(n, format="csc")
    for _ in range(order):
        A = sp.csc_array(A[:, :-1] - A[:, 1:])
    A, g = (-1) ** (order - 1) * A, np.full(A.shape[1], 1e-3 * (order - 1))
    data = Prepared(Assembly(Stiffness.of(sp.eye_array(n, format="csc")), A))
    answer = session_of("newton", data).next(LoadCase(f, g), None)
    assert answer.status == "solved"
    assert answer.iterations is not None
    assert answer.iterations <= 30
    x = f - A @ answer.lam
    gap = g - A.T @ x
    assert max(-gap.min(), abs(np.minimum(answer.lam, gap)).max()) < 1e-9
    if order == 1:
        np.testing.assert_allclose(x, isotonic_regression(f).x, atol=LIMIT_MM)
