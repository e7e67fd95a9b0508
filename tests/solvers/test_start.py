"""Starting points: Algorithms 4 and 5, STP1, STP2, Mehrotra's."""

import numpy as np
import pytest
from small_problems import definite, make_load, make_prepared

from solvers.algorithms.interior_point import algorithm_4, algorithm_5, mehrotra_start, stp1, stp2


def with_negative_rows(size: int = 12) -> np.ndarray:
    """Positive definite with rows of negative sum: a rank-one term pulls some of them down."""
    v = np.where(np.arange(size) % 3 == 0, -1.0, 1.0)
    Q = 0.3 * np.eye(size) + np.outer(v, v)
    assert (Q.sum(axis=1) < 0).any()
    return Q


@pytest.mark.parametrize("Q", [definite(20, 5), with_negative_rows()], ids=["random", "negative rows"])
def test_algorithm_5_starts_inside(Q: np.ndarray) -> None:
    p = np.random.default_rng(0).standard_normal(len(Q)) * 50
    start = algorithm_5(Q, p)
    assert (start.lam > 0).all()
    assert (Q @ start.lam > 0).all()  # (16)
    assert (start.y > 0).all()
    np.testing.assert_allclose(start.y, Q @ start.lam - p, rtol=1e-12, atol=1e-9)  # (13)


def test_rows_of_positive_sum_need_no_correction_and_others_do() -> None:
    p = np.ones(12)
    assert algorithm_5(np.eye(12) + 0.1, p).corrections == 0
    assert algorithm_5(with_negative_rows(), p).corrections > 0


def test_the_start_is_a_power_of_two_times_the_first_forces() -> None:
    """With Q = I and p = 5: λ = 1, 2, 4, 8 (y = 3 ≥ 0), and doubled once more."""
    start = algorithm_5(np.eye(3), np.full(3, 5.0))
    np.testing.assert_array_equal(start.lam, np.full(3, 16.0))
    np.testing.assert_array_equal(start.y, np.full(3, 11.0))
    assert start.multiplications == 4


@pytest.mark.parametrize("seed", range(2))
def test_algorithms_4_and_5_give_the_same_point(seed: int) -> None:
    prepared = make_prepared(seed, pairs=14, tools=3)
    load, _ = make_load(seed, prepared)
    by_x = algorithm_4(prepared, load)
    by_Q = algorithm_5(prepared.Q, prepared.overlap(load))
    np.testing.assert_allclose(by_x.lam, by_Q.lam, rtol=1e-9)
    np.testing.assert_allclose(by_x.y, by_Q.y, rtol=1e-7, atol=1e-9 * abs(by_Q.y).max())
    assert (by_x.corrections, by_x.multiplications) == (by_Q.corrections, by_Q.multiplications)

    # (13) by displacements: equilibrium and the gap that is left.
    x = prepared.assembly.K.solve(load.f - prepared.assembly.A @ by_x.lam)
    np.testing.assert_allclose(load.g - prepared.assembly.A.T @ x, by_x.y, atol=1e-9 * abs(by_x.y).max())


@pytest.mark.parametrize("seed", range(2))
def test_stp1_and_stp2_are_central_and_their_residual_is_small_beside_the_gap(seed: int) -> None:
    Q = definite(30, seed)
    p = np.random.default_rng(seed).standard_normal(30) * 10
    for start in (stp1(Q, p, 0.1), stp2(Q, p, 0.1, 1.0)):
        products = start.lam * start.y
        np.testing.assert_allclose(products, products[0], rtol=1e-12)
        assert (start.lam > 0).all()
        assert (start.y > 0).all()


def test_stp1_scales_once_by_what_is_missing() -> None:
    """Q = I, p = −8e, m = 4: s1 = 1 − (1 + 8) = −8, r = 16, gap = 4, so r/(ρ·gap) = 40 for ρ = 0.1."""
    start = stp1(np.eye(4), np.full(4, -8.0), 0.1)
    np.testing.assert_allclose(start.lam, 40.0)
    np.testing.assert_allclose(stp1(np.eye(4), np.zeros(4), 0.1).lam, 1.0)


def test_stp2_takes_the_open_gaps_as_they_are() -> None:
    p = np.array([-4.0, 3.0])
    start = stp2(np.eye(2) * 1e-9, p, 1e9, 0.5)  # so large a ρ that nothing is scaled
    np.testing.assert_allclose(start.y, [4.0, 0.5])
    np.testing.assert_allclose(start.lam, [0.25, 2.0])


@pytest.mark.parametrize("seed", range(2))
def test_mehrotras_start_is_an_affine_step_kept_inside(seed: int) -> None:
    Q = definite(20, seed)
    p = np.random.default_rng(seed).standard_normal(20)
    start = mehrotra_start(Q, p)
    assert (start.lam > 0).all()
    assert (start.y > 0).all()
    # The affine step solves the linearised conditions; where it stays inside they can be read off.
    y0 = abs(p).max()
    lam0 = y0 * len(p) / np.trace(Q)
    dlam = np.linalg.solve(Q + y0 / lam0 * np.eye(20), p - Q @ np.full(20, lam0))
    np.testing.assert_allclose(start.lam, np.maximum(lam0, abs(lam0 + dlam)))
    dy = Q @ (lam0 + dlam) - p - y0  # the dual residual vanishes after a full step
    np.testing.assert_allclose(start.y, np.maximum(y0, abs(y0 + dy)), rtol=1e-8, atol=1e-10)
