"""Preconditioners, orderings and the conjugate gradients: the Newton systems (Q + D) v = b."""

import numpy as np
import pytest
import scipy.linalg as sla
from sample_size import seeds
from small_problems import definite

from solvers.algorithms.newton_system import conjugate_gradients
from solvers.algorithms.preconditioner import (
    REORDER_AFTER,
    SYSTEMS,
    CholeskyPlusRoot,
    OpenLast,
    Preconditioned,
)

SIZE = 30
ORDER = np.random.default_rng(7).permutation(SIZE)


def matrix_of(name: str, Q: np.ndarray, D: np.ndarray) -> np.ndarray:
    """V as a dense matrix (for `ordered` in the permuted order), from its definition."""
    match name:
        case "none":
            return np.eye(len(Q))
        case "U":
            return sla.cholesky(Q)
        case "V":
            return sla.cholesky(Q) + np.diag(np.sqrt(D))
        case "ordered":
            return sla.cholesky(Q[np.ix_(ORDER, ORDER)]) + np.diag(np.sqrt(D[ORDER]))
    V = np.diag(np.sqrt(D + np.diag(Q)))
    small = np.diag(Q) >= D
    V[np.ix_(small, small)] = sla.cholesky((Q + np.diag(D))[np.ix_(small, small)])
    return V


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", ["none", "U", "V", "ordered", "splitting"])
def test_the_preconditioned_operator_matches_its_definition(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    Q = definite(SIZE, seed)
    D = 10 ** rng.uniform(-8, 8, SIZE)
    V = matrix_of(name, Q, D)
    p = ORDER if name == "ordered" else np.arange(SIZE)
    H = (Q + np.diag(D))[np.ix_(p, p)]
    wanted = np.linalg.solve(V.T, np.linalg.solve(V.T, H).T).T

    preconditioner = CholeskyPlusRoot(Q, ORDER) if name == "ordered" else SYSTEMS[name](Q)
    assert isinstance(preconditioner, Preconditioned)
    preconditioner.take(rng.uniform(1, 2, SIZE))  # what an update leaves must not stay
    preconditioner.take(D)
    found = np.column_stack([preconditioner.multiply(e) for e in np.eye(SIZE)])

    np.testing.assert_allclose(found, wanted, atol=1e-7 * abs(wanted).max())
    b = rng.standard_normal(SIZE)
    np.testing.assert_allclose(V @ preconditioner.from_transformed(b)[p], b, atol=1e-7)
    np.testing.assert_allclose(V.T @ preconditioner.to_transformed(b), b[p], atol=1e-7)


@pytest.mark.parametrize("seed", seeds(5, 20))
def test_the_smallest_eigenvalue_of_v_is_above_one_half(seed: int) -> None:
    rng = np.random.default_rng(seed)
    Q = definite(SIZE, seed, condition=10 ** rng.uniform(1, 6))
    V = CholeskyPlusRoot(Q)
    V.take(10 ** rng.uniform(-8, 8, SIZE))
    found = np.column_stack([V.multiply(e) for e in np.eye(SIZE)])
    assert np.linalg.eigvalsh((found + found.T) / 2)[0] >= 0.5 - 1e-7


def test_v_becomes_exact_where_large_d_stands_last() -> None:
    """D = 0 on the first half, huge on the second: the spectrum is 1 in this order, not in the other."""
    Q = definite(SIZE, 3)
    D = np.where(np.arange(SIZE) < SIZE // 2, 0.0, 1e14)
    last, first = CholeskyPlusRoot(Q), CholeskyPlusRoot(Q, np.arange(SIZE)[::-1].copy())
    for V, close in ((last, True), (first, False)):
        V.take(D)
        found = np.column_stack([V.multiply(e) for e in np.eye(SIZE)])
        assert np.allclose(found, np.eye(SIZE), atol=1e-4) == close


def test_open_gaps_go_last_after_a_slow_system() -> None:
    rng = np.random.default_rng(0)
    size = 120
    Q = definite(size, 0, condition=1e6)
    D = np.where(rng.random(size) < 0.5, 1e-9, 1e12)
    b = rng.standard_normal(size)
    plain, ordered = CholeskyPlusRoot(Q), OpenLast(Q)
    for system in (plain, ordered):
        system.begin()
    first = ordered.solve(D, b, 1e-8, 10_000)
    assert first.iterations == plain.solve(D, b, 1e-8, 10_000).iterations > REORDER_AFTER
    second = ordered.solve(D, b, 1e-8, 10_000)
    assert ordered.factorisations == 1
    assert second.iterations < first.iterations / 5
    np.testing.assert_allclose(second.v, first.v, atol=1e-5 * abs(first.v).max())


def test_conjugate_gradients_say_when_they_do_not_converge() -> None:
    H = definite(40, 0, condition=1e8)
    assert not conjugate_gradients(lambda v: H @ v, np.ones(40), 1e-12, 3).converged
    assert not conjugate_gradients(lambda v: -v, np.ones(4), 1e-12, 10).converged
