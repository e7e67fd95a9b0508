"""A banded M ≈ Q⁻¹ in place of a factorisation of Q: in newton, ipm and ipm-fast, and where it is no good."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as sla
from scipy.optimize import nnls
from test_newton import definite

from problems.forms.assembly import LoadCase
from problems.forms.banded_inverse import banded_inverse
from problems.forms.prepared import dual_alone, load_of
from problems.forms.problem import Problem, in_form
from solvers.active_set.batched import BatchedSweeps
from solvers.base import Answer, WarmStart
from solvers.interior_point.banded import Banded
from solvers.kkt import rounding_of
from solvers.linear_algebra.approximate_inverse import approximate_inverse
from solvers.methods.ipm import Ipm
from solvers.methods.ipm_fast import FastIpm
from solvers.methods.newton import ActiveSetNewton

LINES, ACROSS = 110, 4
M_CONTACTS = LINES * ACROSS


def decaying() -> np.ndarray:
    """exp(−distance) between the contacts of a joint, positive definite; numbered line by line."""
    nodes = np.array([(i, j) for i in range(LINES) for j in range(ACROSS)], dtype=float)
    distance = np.linalg.norm(nodes[:, None] - nodes[None], axis=2)
    return np.asfortranarray(np.exp(-distance / 3))


def problem(Q: np.ndarray, seed: int, mean: float) -> tuple[Problem, LoadCase]:
    p = np.random.default_rng(seed).standard_normal(len(Q)) + mean
    made = in_form(dual_alone(Q), "dual")
    (load,) = made.loads([load_of(p)])
    return made, load


def exact(Q: np.ndarray, p: np.ndarray) -> np.ndarray:
    U = sla.cholesky(Q)
    return nnls(U, sla.solve_triangular(U, p, trans=1), maxiter=10_000)[0]


def check(answer: Answer, Q: np.ndarray, p: np.ndarray) -> None:
    assert answer.status == "solved"
    assert answer.lam is not None
    np.testing.assert_allclose(answer.lam, exact(Q, p), atol=1e-8)


def test_the_banded_inverse_is_taken_where_q_decays_alone() -> None:
    M = approximate_inverse(decaying(), None)
    assert M is not None
    assert len(M.band) < M_CONTACTS / 4
    assert approximate_inverse(definite(M_CONTACTS, seed=1), None) is None
    assert approximate_inverse(decaying()[:64, :64], None) is None  # small: Q⁻¹ costs nothing
    one_bad = decaying()
    one_bad += 100.0 * np.outer(v := np.random.default_rng(2).standard_normal(M_CONTACTS), v)
    assert approximate_inverse(np.asfortranarray(one_bad), None) is None


@pytest.mark.parametrize("mean", [0.0, 3.0, 8.0])
def test_sweeps_solve_a_single_case_without_a_factorisation_of_q(mean: float) -> None:
    Q = decaying()
    made, load = problem(Q, 3, mean)
    solver = ActiveSetNewton()
    state = solver.prepare(made)
    answer = solver.solve(state, load, 1e-11)
    check(answer, Q, load.p)
    assert "factorisations" not in answer.details
    assert "inverse" not in vars(state.data)


def test_few_closed_contacts_have_a_small_system_of_their_own() -> None:
    Q = decaying()
    made, load = problem(Q, 4, -2.5)
    solver = ActiveSetNewton()
    state = solver.prepare(made)
    answer = solver.solve(state, load, 1e-11)
    check(answer, Q, load.p)
    assert 0 < answer.details["closed"] < M_CONTACTS / 16
    assert answer.details["factorisations"] > 0
    assert "inverse" not in vars(state.data)


@pytest.mark.parametrize("few", [True, False])
def test_the_next_case_starts_from_the_one_before(few: bool) -> None:
    Q = decaying()
    made, load = problem(Q, 5, -2.5 if few else 0.0)
    solver = ActiveSetNewton()
    state = solver.prepare(made)
    first = solver.solve(state, load, 1e-11)
    assert first.lam is not None
    near = LoadCase(load.f, load.g, load.p + 1e-3 * np.sin(np.arange(M_CONTACTS)))
    start = WarmStart(load, first.lam, Q @ first.lam - load.p)
    again = solver.solve(solver.update(state, state, near, 1e-11, start), near, 1e-11)
    check(again, Q, near.p)
    if few:  # no subsets
        assert (again.inner_iterations, first.inner_iterations > 0) == (0, True)
    else:
        assert again.iterations < first.iterations


def test_what_sweeps_do_not_settle_is_solved_with_q_inverse(monkeypatch: pytest.MonkeyPatch) -> None:
    Q = decaying()
    made, load = problem(Q, 6, 0.0)
    load = LoadCase(load.f, load.g, Q.sum(axis=1) + 0.3 * load.p)  # most contacts closed
    solver = ActiveSetNewton()
    state = solver.prepare(made)
    monkeypatch.setattr(state.sweeps, "max_sweeps", 1)
    answer = solver.solve(state, load, 1e-11)
    check(answer, Q, load.p)
    assert answer.details["factorisations"] > 0
    assert "inverse" in vars(state.data)


def test_an_indefinite_matrix_fails() -> None:
    Q = decaying()
    Q[:, 7] = Q[7, :] = 0.0
    Q[7, 7] = -1.0
    made, load = problem(Q, 7, 0.0)
    for solver in (ActiveSetNewton(), FastIpm()):
        answer = solver.solve(solver.prepare(made), load, 1e-10)
        assert answer.status == "failed"
        assert "not positive definite" in answer.details["cause"]


@pytest.mark.parametrize("size", [1.0, 1e5])
def test_sweeps_settle_on_gaps_computed_from_the_forces(size: float) -> None:
    """Of a p as large as 1e5 mm, rounding is not far below the tolerance."""
    Q, rng = decaying(), np.random.default_rng(10)
    p = size * rng.uniform(-1, 1, M_CONTACTS)
    tolerance = 20 * rounding_of(p, p)
    M = approximate_inverse(Q, None)
    assert M is not None
    sweeps = BatchedSweeps(Q, np.diag(Q), M, lambda *given: pytest.fail("not asked for"))
    case = sweeps.cold(LoadCase(p, p, p), tolerance)
    lam = np.empty(M_CONTACTS)
    lam[M.order] = case.trial.lam
    y = (Q @ lam - p)[M.order]
    assert case.settled
    np.testing.assert_allclose(case.trial.y, y, atol=tolerance / 10)
    assert abs(y[case.C]).max() <= tolerance
    assert y[~case.C].min() > 0
    assert case.trial.lam[case.C].min() > 0


def test_the_banded_preconditioner_is_the_inverse_of_its_definition() -> None:
    Q, rng = decaying()[:80, :80], np.random.default_rng(8)
    shuffled = rng.permutation(80)
    Q = np.asfortranarray(Q[np.ix_(shuffled, shuffled)])
    M = banded_inverse(Q, np.column_stack([shuffled // ACROSS, shuffled % ACROSS]).astype(float))
    dense = np.zeros((80, 80))
    dense[np.ix_(M.order, M.order)] = np.column_stack([M.product(e) for e in np.eye(80)])
    D = 10 ** rng.uniform(-6, 6, 80)
    system = Banded(Q, M)
    b = rng.standard_normal(80)
    solved = system.solve(D, b, 1e-10, 1000)
    np.testing.assert_allclose(solved.v, np.linalg.solve(Q + np.diag(D), b), atol=1e-8)
    found = np.column_stack([system._precondition(e) for e in np.eye(80)])
    np.testing.assert_allclose(found, np.linalg.inv(np.linalg.inv(dense) + np.diag(D)), atol=1e-9)
    system.solve(D, 2 * b, 1e-10, 1000)
    assert system.factorisations == 1


@pytest.mark.parametrize("size", [1e-10, 1.0, 1e10])
def test_conjugate_gradients_with_the_band_take_few_iterations_for_any_d(size: float) -> None:
    Q, rng = decaying(), np.random.default_rng(9)
    M = approximate_inverse(Q, None)
    assert M is not None
    D = np.where(rng.random(M_CONTACTS) < 0.5, size, 1 / size)
    b = rng.standard_normal(M_CONTACTS)
    solved = Banded(Q, M).solve(D, b, 1e-8, 1000)
    assert solved.converged
    assert solved.iterations <= 10
    np.testing.assert_allclose(solved.v, np.linalg.solve(Q + np.diag(D), b), atol=1e-6 * abs(solved.v).max())


@pytest.mark.parametrize("mean", [-1.0, 1.0])
def test_interior_points_with_the_band(mean: float) -> None:
    Q = decaying()
    made, load = problem(Q, 10, mean)
    fast = FastIpm()
    check(fast.solve(fast.prepare(made), load, 1e-11), Q, load.p)
    counts = {}
    for name in ("V", "band"):
        solver = Ipm(preconditioner=name)
        answer = solver.solve(solver.prepare(made), load, 1e-16)
        check(answer, Q, load.p)
        counts[name] = answer.inner_iterations
    assert counts["band"] < counts["V"] / 3
