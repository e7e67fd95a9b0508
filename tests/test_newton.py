"""The active-set Newton method: its factor, its two ways to a set's forces and gaps, and its answers."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as sla
from scipy.optimize import nnls
from small import make_load, make_prepared, solve_by_nnls
from solvers.active_set.nested import cells_of, representatives

from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.forms.problem import in_form
from problems.forms.product import product
from problems.manufactured.ladder import make_rung
from problems.stiffness.operator import Stiffness
from solvers.active_set.block_pivoting import MAX_STALE_PASSES, block_pivoting
from solvers.active_set.bordered_factor import BorderedFactor
from solvers.active_set.contact_sets import ContactSets, trial_of
from solvers.linear_algebra.inverse import BLOCK, inverse_with_factor
from solvers.methods.newton import ActiveSetNewton


def definite(size: int, seed: int, condition: float = 1e4) -> np.ndarray:
    rng = np.random.default_rng(seed)
    W, _ = np.linalg.qr(rng.standard_normal((size, size)))
    G = (W * np.geomspace(1.0, condition, size)) @ W.T
    return np.asfortranarray((G + G.T) / 2)


def subset(rng: np.random.Generator, size: int, share: float) -> np.ndarray:
    return rng.random(size) < share


@pytest.mark.parametrize("size", [1, BLOCK, BLOCK + 1, 2 * BLOCK + 3])
def test_the_inverse_is_full_and_symmetric(size: int) -> None:
    Q = definite(size, seed=size)
    inverse, U = inverse_with_factor(Q)
    np.testing.assert_allclose(inverse @ Q, np.eye(size), atol=1e-9)
    np.testing.assert_array_equal(inverse, inverse.T)
    np.testing.assert_allclose(U.T @ U, Q, atol=1e-9 * abs(Q).max())


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_a_border_gives_what_a_factor_of_its_own_would(share: float) -> None:
    size, rng = 60, np.random.default_rng(1)
    G = definite(size, seed=2)
    base = subset(rng, size, share)
    factor = BorderedFactor(G, base)
    for _ in range(12):
        S = base ^ subset(rng, size, 0.2)
        b = rng.standard_normal(size)
        factor.move_to(S)
        u = factor.solve(b)
        rows = np.flatnonzero(S)
        wanted = np.zeros(size)
        wanted[rows] = np.linalg.solve(G[np.ix_(rows, rows)], b[rows])
        np.testing.assert_allclose(u, wanted, atol=1e-9)
        assert factor.changes(S) == (S ^ base).sum()
    assert factor.Z.shape[1] <= size  # a column is made once


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("with_inverse", [False, True])
def test_the_forces_and_gaps_of_a_set(share: float, with_inverse: bool) -> None:
    """λ = 0 off C, y = 0 on it and y = Qλ − p, whether forces or gaps are the unknowns."""
    size, rng = 50, np.random.default_rng(3)
    Q, p = definite(size, seed=4), rng.standard_normal(50)
    sets = ContactSets(Q, p, (lambda: np.linalg.inv(Q)) if with_inverse else None)
    C = subset(rng, size, share)
    for _ in range(5):
        found = sets.at(C)
        worse = trial_of(Q, p, C, found.lam * (1 + 1e-6))
        for trial in (found, sets.refined(C, worse, 1e-11)):
            assert not trial.lam[~C].any()
            assert abs(trial.y[C]).max(initial=0) <= 1e-10
            np.testing.assert_allclose(Q @ trial.lam - p, trial.y, atol=1e-10)
            assert trial.rounding <= 1e-10
        if C.any():
            assert worse.rounding > 1e-9
        C = C ^ subset(rng, size, 0.05)


def test_more_than_half_closed_needs_the_factor_of_the_rest_alone() -> None:
    Q = definite(40, seed=5)
    sets = ContactSets(Q, np.ones(40), lambda: np.linalg.inv(Q))
    sets.at(np.arange(40) < 30)
    assert sets.system.factor.rows.tolist() == list(range(30, 40))
    sets.at(np.arange(40) < 20)
    assert sets.system.factor.rows.tolist() == list(range(20))
    assert sets.factorisations == 2


def test_a_product_with_few_columns() -> None:
    G = definite(30, seed=6)
    for count in (0, 1, 7, 8, 30):
        v = np.where(np.arange(30) < count, 1.5, 0.0)
        np.testing.assert_allclose(product(G, v), G @ v, atol=1e-12 * abs(G).max())


@pytest.mark.parametrize("forces_first", [0, MAX_STALE_PASSES])
def test_pivoting_ends_where_full_exchanges_cycle(forces_first: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A beam pressed on a rigid floor, Q its stiffness by second differences: many starts circle there."""
    monkeypatch.setattr("solvers.active_set.block_pivoting.MAX_STALE_PASSES", forces_first)
    size, circled = 20, 0
    bending = np.diff(np.eye(size + 4), 2, axis=0)[:, 2:-2]
    Q = np.asfortranarray(bending.T @ bending)
    U = sla.cholesky(Q)
    for seed in range(40):
        p = np.random.default_rng(seed).standard_normal(size)
        sets = ContactSets(Q, p)
        found = block_pivoting(sets.at, p > 0, sets.compliance, 1e-12, 10_000)
        assert found.converged
        wanted = nnls(U, sla.solve_triangular(U, p, trans=1))[0]
        np.testing.assert_allclose(found.trial.lam, wanted, atol=1e-8 * max(1.0, wanted.max()))
        circled += found.single_exchanges > 0
    assert circled > 3 if forces_first == 0 else circled == 0


def test_a_cell_has_one_representative_and_it_overlaps_most() -> None:
    x, y = np.meshgrid(np.arange(8.0), np.arange(6.0))
    nodes = np.column_stack([x.ravel(), y.ravel()])
    p = np.random.default_rng(0).standard_normal(48)
    cells = cells_of(nodes, 48, 2)
    rows = representatives(cells, p)
    assert len(rows) == len(np.unique(cells)) < 48
    for row in rows:
        assert p[row] == p[cells == cells[row]].max()


@pytest.mark.parametrize("nodes", [None, np.zeros((10, 2)), np.arange(20.0).reshape(10, 2)])
def test_cells_of_whatever_coordinates(nodes: np.ndarray | None) -> None:
    cells = cells_of(nodes, 10, 2)
    assert cells.shape == (10,)
    assert 1 <= len(np.unique(cells)) <= 10


def solved(prepared: Prepared, load: LoadCase, tolerance: float = 1e-11, **options):
    solver = ActiveSetNewton(**options)
    return solver.solve(solver.prepare(in_form(prepared, "dual")), load, tolerance)


@pytest.mark.parametrize("nested", [True, False])
@pytest.mark.parametrize("seed", range(10))
def test_answers_against_nnls(seed: int, nested: bool) -> None:
    prepared = make_prepared(seed, 5 + 4 * seed, tools=seed % 3)
    case, load = make_load(seed, prepared)
    answer = solved(prepared, load, nested=nested)
    x, lam = solve_by_nnls(prepared, case)
    assert answer.status == "solved"
    np.testing.assert_allclose(answer.lam, lam, atol=1e-7 * max(1.0, lam.max()))
    np.testing.assert_allclose(prepared.recover(answer.lam, case), x, atol=1e-10)
    assert answer.details["closed"] >= (lam > 0).sum()


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_weakly_active_contacts_do_no_harm(share: float) -> None:
    """λ* and y* are made to order, a share of the contacts with both zero."""
    rng = np.random.default_rng(7)
    m = 60
    Q = definite(m, seed=8)
    weak = rng.random(m) < share
    lam = np.where(weak | (rng.random(m) < 0.5), 0.0, rng.random(m) + 0.1)
    y = np.where(weak | (lam > 0), 0.0, rng.random(m) + 0.1)
    p = Q @ lam - y
    sets = ContactSets(Q, p, lambda: np.linalg.inv(Q))
    found = block_pivoting(sets.at, p > 0, sets.compliance, 1e-11, 200)
    assert found.converged
    np.testing.assert_allclose(np.maximum(found.trial.lam, 0), lam, atol=1e-8)


def test_the_limit_on_sets_is_kept_and_reported() -> None:
    prepared = make_prepared(1, 30)
    _, load = make_load(1, prepared)
    answer = solved(prepared, load, nested=False, max_sets=1)
    assert (answer.status, answer.iterations) == ("iteration_limit", 1)
    assert (answer.lam >= 0).all()


@pytest.mark.parametrize("batched", [False, True])
def test_sets_that_make_no_progress_give_way_to_an_interior_point(
    batched: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With no stale pass allowed, Fathi's problem in random order is beyond the sets alone."""
    for name, value in (("block_pivoting.MAX_STALE_PASSES", 0), ("block_pivoting.MAX_SINGLE_EXCHANGES", 0)):
        monkeypatch.setattr(f"solvers.active_set.{name}", value)
    monkeypatch.setattr("solvers.active_set.solve.MAX_SINGLE_EXCHANGES", 0)
    made = make_rung("hard/pivoting/fathi-064").made
    assert made is not None
    order = np.random.default_rng(5).permutation(64)
    K = np.asfortranarray(made.assembly.K.matrices[0][np.ix_(order, order)])
    problem = in_form(Prepared(Assembly(Stiffness.of(K), made.assembly.A)), "dual")
    (load,) = problem.loads([made.load])
    solver = ActiveSetNewton(nested=False)
    state = solver.prepare(problem)
    if batched:
        batch = solver.batched(state)
        assert batch is not None
        batch.use_sweeps = False
        (answer,) = batch([load], 1e-10)
    else:
        answer = solver.solve(state, load, 1e-10)
    assert answer.status == "solved"
    assert answer.details["interior_point"]
    assert np.flatnonzero(answer.lam).tolist() == [int(np.flatnonzero(order == 0)[0])]
