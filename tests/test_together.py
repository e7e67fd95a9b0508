"""A banded M ≈ Q⁻¹, and many load cases at once with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from small import make_load, make_prepared, solve_by_nnls
from strip import write_strip

from harness.conformance.known_problems import contact_rows
from harness.solving.session import SolverSession
from problems.build import load_case, prepared
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.banded_inverse import BandedInverse, banded_inverse, order_along_joint
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.load_cases.random_gaps import random_gaps
from problems.scene import read_scene
from problems.stiffness.operator import Stiffness
from solvers.active_set.batched import BatchedSweeps
from solvers.active_set.bordered_factor import Set
from solvers.active_set.contact_sets import TrialSolution
from solvers.base import Answer
from solvers.methods.newton import ActiveSetNewton
from solvers.registry import make_solver

TOLERANCE = 1e-10


def dense(M: BandedInverse) -> np.ndarray:
    return np.column_stack([M.product(e) for e in np.eye(len(M.order))])


def chain(m: int) -> np.ndarray:
    """The stiffness of m masses in a row, each held to the next and to the ground."""
    rng = np.random.default_rng(m)
    k = rng.uniform(1, 3, m)
    return np.diag(rng.uniform(0.1, 1, m) + k + np.r_[0, k[:-1]]) - np.diag(k[:-1], 1) - np.diag(k[:-1], -1)


def grid(nx: int, ny: int, rng: np.random.Generator | None = None) -> np.ndarray:
    x, y = np.meshgrid(10.0 * np.arange(nx), 10.0 * np.arange(ny))
    nodes = np.column_stack([x.ravel(), y.ravel()])
    return nodes if rng is None else nodes[rng.permutation(len(nodes))]


def alone(C: Set | None, load: LoadCase, tolerance: float) -> Answer:
    raise AssertionError("all are settled together")


def test_where_forces_act_on_neighbours_alone_it_is_the_inverse() -> None:
    """Q⁻¹ tridiagonal: what is known of the contacts before says nothing more than the last one."""
    K = chain(40)
    shuffled = np.random.default_rng(0).permutation(40)
    Q = np.asfortranarray(np.linalg.inv(K)[np.ix_(shuffled, shuffled)])
    M = banded_inverse(Q, np.column_stack([7.0 * shuffled, np.zeros(40)]))
    np.testing.assert_array_equal(shuffled[M.order], np.arange(40))
    np.testing.assert_allclose(dense(M), K, atol=1e-12)


def test_a_window_of_all_contacts_gives_the_inverse() -> None:
    Q = make_prepared(1, 30).Q
    M = banded_inverse(Q, None)
    np.testing.assert_allclose(dense(M) @ Q, np.eye(30), atol=1e-10)


@pytest.mark.parametrize(("nx", "ny"), [(9, 4), (4, 9), (12, 1), (6, 6)])
def test_contacts_stand_in_lines_across_the_joint(nx: int, ny: int) -> None:
    nodes = grid(nx, ny, np.random.default_rng(0))
    order, across = order_along_joint(nodes, len(nodes))
    longer = 0 if nx >= ny else 1
    assert across == min(nx, ny)
    assert (np.diff(nodes[order, longer]) >= 0).all()
    both, twice = order_along_joint(np.vstack([nodes, nodes]), 2 * len(nodes))  # two contacts at each place
    assert twice == 2 * across
    assert sorted(both) == list(range(2 * len(nodes)))


@pytest.mark.parametrize(("dx", "across"), [(0.6, 5), (1.0, 5), (0.15, 15)])
def test_lines_a_little_closer_than_wide_are_lines_still(dx: float, across: int) -> None:
    x, y = np.meshgrid(dx * np.arange(40), np.arange(5.0))
    nodes = np.column_stack([x.ravel(), y.ravel()])
    assert order_along_joint(nodes, 200)[1] == across
    assert order_along_joint(np.zeros((7, 2)), 7)[1] == 7  # all in one place


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 1.0])
def test_a_band_factor_solves_with_the_principal_submatrix(share: float, tmp_path: Path) -> None:
    data = prepared(read_scene(str(write_strip(tmp_path))))
    M = banded_inverse(data.Q, data.assembly.contact_nodes)
    full, rng = dense(M), np.random.default_rng(2)
    assert len(M.band) - 2 < 44  # a band, not all of it
    assert np.linalg.eigvalsh(full)[0] > 0
    S, b = rng.random(45) < share, rng.standard_normal(45)
    wanted = np.zeros(45)
    wanted[S] = np.linalg.solve(full[np.ix_(S, S)], b[S])
    np.testing.assert_allclose(M.factor(S).solve(b), wanted, rtol=1e-10, atol=1e-12)


def test_what_is_not_positive_definite_is_said() -> None:
    with pytest.raises(np.linalg.LinAlgError, match="minor 3"):
        banded_inverse(np.diag([1.0, 1.0, -1.0, 1.0]), None)


@pytest.mark.parametrize("tools", [0, 7])
def test_answers_against_nnls(tools: int) -> None:
    data = make_prepared(3, 25, tools)
    pairs = [make_load(seed, data) for seed in range(20)]
    solve = ActiveSetNewton().batched(ActiveSetNewton().prepare(in_form(data, "dual")))
    assert solve is not None
    for (case, _), answer in zip(pairs, solve([load for _, load in pairs], TOLERANCE), strict=True):
        x, lam = solve_by_nnls(data, case)
        assert answer.status == "solved"
        assert answer.lam is not None
        np.testing.assert_allclose(answer.lam, lam, atol=1e-6)
        np.testing.assert_allclose(data.recover(answer.lam, case), x, atol=1e-9)


def strip_loads(folder: Path, count: int) -> tuple[Any, list[Any], list[LoadCase]]:
    scene = read_scene(str(write_strip(folder)))
    data = prepared(scene)
    series = random_gaps(scene, count, 3)
    cases = [load_case(scene), *(series.load(k) for k in range(count - 1))]
    return data, cases, [LoadCase(case.f, case.g, data.dual_load(case)) for case in cases]


def test_a_strip_with_random_gaps_in_blocks_of_any_size(tmp_path: Path) -> None:
    """Sweeps settle all of them, as NNLS does, whatever was solved before."""
    data, cases, loads = strip_loads(tmp_path, 24)
    M = banded_inverse(data.Q, data.assembly.contact_nodes)
    at_once = BatchedSweeps(data.Q, np.diag(data.Q), M, alone)(loads, TOLERANCE)
    in_threes = BatchedSweeps(data.Q, np.diag(data.Q), M, alone)
    three = [answer for k in range(0, 24, 3) for answer in in_threes(loads[k : k + 3], TOLERANCE)]
    backwards = BatchedSweeps(data.Q, np.diag(data.Q), M, alone)(loads[::-1], TOLERANCE)[::-1]
    closed = set()
    for case, *answers in zip(cases, at_once, three, backwards, strict=True):
        x, lam = solve_by_nnls(data, case)
        closed.add(int((lam > 0).sum()))
        for answer in answers:
            assert answer.status == "solved"
            assert answer.lam is not None
            assert answer.details["closed"] == (lam > 0).sum()
            np.testing.assert_allclose(data.recover(answer.lam, case), x, atol=1e-9)
    assert len(closed) > 3


def test_contacts_that_all_open_or_all_close(tmp_path: Path) -> None:
    data, _, loads = strip_loads(tmp_path, 2)
    spread = np.full(45, 100.0)  # N at each contact
    closed = LoadCase(loads[0].f, loads[0].g, data.Q @ spread)
    opened = LoadCase(loads[0].f, loads[0].g, -spread)
    M = banded_inverse(data.Q, data.assembly.contact_nodes)
    shut, free = BatchedSweeps(data.Q, np.diag(data.Q), M, alone)([closed, opened], TOLERANCE)
    np.testing.assert_allclose(shut.lam, spread, rtol=1e-6)
    assert free.lam is not None
    assert not free.lam.any()


def test_what_sweeps_do_not_settle_is_solved_alone_and_soon_at_once() -> None:
    """Contacts that know nothing of their neighbours: M is worth nothing, the answers are right."""
    rng = np.random.default_rng(5)
    W, _ = np.linalg.qr(rng.standard_normal((120, 120)))
    K = (W * np.geomspace(1.0, 1e4, 120)) @ W.T
    data = Prepared(Assembly(Stiffness.of(np.asfortranarray((K + K.T) / 2)), contact_rows(0, 120)))
    pairs = [make_load(seed, data) for seed in range(6)]
    solver = ActiveSetNewton()
    batch = solver.batched(solver.prepare(in_form(data, "dual")))
    assert batch is not None
    for again in range(2):
        answers = batch([load for _, load in pairs], TOLERANCE)
        alone = ["factorisations" in answer.details for answer in answers]
        assert sum(alone) >= (6 if again else 3)
        for (case, _), answer in zip(pairs, answers, strict=True):
            x, lam = solve_by_nnls(data, case)
            assert answer.lam is not None
            assert answer.details["closed"] == (lam > 0).sum()
            np.testing.assert_allclose(data.recover(answer.lam, case), x, atol=1e-8)
        assert not batch.use_sweeps


def test_a_near_case_is_where_the_next_one_begins() -> None:
    """M = Q⁻¹: from a case with the same contacts a single sweep is right, wherever p has gone; one more
    computes y from λ.
    """
    data = make_prepared(3, 25)
    first = make_load(1, data)[1]
    closed = solve_by_nnls(data, LoadCase(first.f, first.g))[1] > 0
    change = data.Q @ np.where(closed, 1.0, 0.0)  # N more on each closed contact
    second = LoadCase(first.f, first.g, first.p + change)
    batch = BatchedSweeps(data.Q, np.diag(data.Q), banded_inverse(data.Q, None), alone)
    one, two = (batch([load], TOLERANCE)[0] for load in (first, second))
    assert one.lam is not None
    assert two.iterations == 2
    np.testing.assert_allclose(two.lam, one.lam + closed, atol=1e-6)


def test_who_solves_alone_is_given_the_contacts_as_they_are_numbered(tmp_path: Path) -> None:
    data, cases, loads = strip_loads(tmp_path, 6)
    M = banded_inverse(data.Q, data.assembly.contact_nodes)
    assert (M.order != np.arange(45)).any()
    starts: list[Set | None] = []

    def told(C: Set | None, load: LoadCase, tolerance: float) -> Answer:
        starts.append(C)
        return Answer("solved", np.zeros(45))

    # Four sweeps are not enough to be done, but for the set.
    batch = BatchedSweeps(data.Q, np.diag(data.Q), M, told, max_sweeps=4)
    batch(loads[:1], TOLERANCE)
    starts.clear()
    batch.use_sweeps = True
    batch(loads[1:], TOLERANCE)
    assert len(starts) == 5
    for C, case in zip(starts, cases[1:], strict=True):
        assert C is not None
        assert ((solve_by_nnls(data, case)[1] > 0) == C).mean() > 0.9


def test_an_answer_is_worth_what_its_own_forces_say(tmp_path: Path) -> None:
    """A force below zero is cut off, and the gaps are looked at again."""
    data, _, loads = strip_loads(tmp_path, 1)
    M = banded_inverse(data.Q, data.assembly.contact_nodes)
    batch = BatchedSweeps(data.Q, np.diag(data.Q), M, alone)
    batch(loads, TOLERANCE)
    (case,) = batch.last
    lam = case.trial.lam.copy()
    lam[case.C.argmax()] = -1e-3
    case.trial = TrialSolution(lam, case.trial.y, 0.0)
    answer = batch.answer(case, loads[0], TOLERANCE)
    assert answer.status == "inaccurate"
    assert answer.lam is not None
    assert answer.lam.min() == 0
    y = data.Q @ answer.lam - loads[0].p
    residual = max(-y.min(), abs(y[answer.lam > 0]).max())
    assert answer.details["kkt_residual_mm"] == pytest.approx(residual)


def test_few_closed_contacts_are_solved_one_case_after_another(tmp_path: Path) -> None:
    data, cases, _ = strip_loads(tmp_path, 5)
    wide = [LoadCase(case.f, case.g + 6.0) for case in cases[1:]]  # one or two of 45 contacts close
    asked: list[Set | None] = []
    solver = ActiveSetNewton()
    batch = solver.batched(solver.prepare(in_form(data, "dual")))
    assert batch is not None
    own = batch.solve_one

    def counted(C: Set | None, load: LoadCase, tolerance: float) -> Answer:
        asked.append(C)
        return own(C, load, tolerance)

    batch.solve_one = counted
    answers = batch([LoadCase(c.f, c.g, data.dual_load(c)) for c in wide], TOLERANCE)
    assert asked == [None] * 4
    for case, answer in zip(wide, answers, strict=True):
        x, lam = solve_by_nnls(data, case)
        assert 1 <= (lam > 0).sum() <= 2
        assert answer.lam is not None
        np.testing.assert_allclose(data.recover(answer.lam, case), x, atol=1e-9)


def test_newton_has_no_such_way_without_a_factor() -> None:
    data = make_prepared(1, 5)
    broken = type(data)(data.assembly, data.assembly.K.factors, -data.Q)
    solver = ActiveSetNewton()
    assert solver.batched(solver.prepare(in_form(broken, "dual"))) is None


def test_what_sweeps_settle_is_solved() -> None:
    """A beam with nearly dependent contacts: gaps within the rounding of y, and beyond the tolerance."""
    D = np.eye(8) - 2 * np.eye(8, k=-1) + np.eye(8, k=-2)
    A = np.eye(8)
    A[range(0, 8, 2), range(1, 8, 2)] = 512.0, 2048.0, 8.0, 64.0
    data = Prepared(Assembly(Stiffness.of(1024 * D.T @ D), sp.csc_array(A)))
    x = np.array([[-1, -2, -2, -2, -2, -2, -2, -2], [-61, 14, 49, -36, -47, 61, -13, -7]]) / 4096
    lam = np.array([[0.25, 0, 0, 0, 0, 0, 0, 0], [0, 11.25, 0, 0, 0, 0, 0, 0]])
    y = np.array([[0, 1, 1, 1, 1, 1, 1, 1], [0, 0, 14, 60, 0, 27, 97, 0]]) / 4096
    cases = [
        LoadCase(data.assembly.K.multiply(u) + A @ v, A.T @ u + w) for u, v, w in zip(x, lam, y, strict=True)
    ]
    session = SolverSession(make_solver("newton", {}), in_form(data, "dual"), TOLERANCE)
    session.open(batched=True)
    answers = session.solve_batch(session.problem.loads([*cases, cases[0]]))
    assert [answer.status for answer in answers] == ["solved"] * 3
