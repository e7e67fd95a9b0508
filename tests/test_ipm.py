"""The interior-point method's parts: starting point, preconditioner, conjugate gradients, iteration."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as sla
from test_gi import by_nnls, definite

from problems.errors import InputError
from solvers.base import Load
from solvers.conjugate_gradients import conjugate_gradients
from solvers.ipm import Ipm
from solvers.preconditioner import CholeskyPlusRoot
from solvers.start import NoStart, algorithm_5


def with_negative_rows(size: int = 12) -> np.ndarray:
    """Positive definite with rows of negative sum: a rank-one term pulls some of them down."""
    v = np.where(np.arange(size) % 3 == 0, -1.0, 1.0)
    Q = 0.3 * np.eye(size) + np.outer(v, v)
    assert (Q.sum(axis=1) < 0).any()
    return Q


@pytest.mark.parametrize("Q", [definite(20, 5), with_negative_rows()], ids=["random", "negative rows"])
def test_algorithm_5_starts_inside(Q: np.ndarray) -> None:
    p = np.random.default_rng(0).standard_normal(len(Q)) * 50
    lam, y = algorithm_5(Q, p)
    assert (lam > 0).all()
    assert (Q @ lam > 0).all()
    assert (y > 0).all()
    np.testing.assert_allclose(y, Q @ lam - p, rtol=1e-12, atol=1e-9)


def test_a_start_that_cannot_be_is_said() -> None:
    with pytest.raises(NoStart, match="no λ > 0"):
        algorithm_5(-np.eye(3), np.ones(3), max_steps=5)


@pytest.mark.parametrize("seed", range(5))
def test_the_preconditioned_operator_is_what_it_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    Q = definite(30, seed)
    D = 10 ** rng.uniform(-8, 8, 30)
    U = sla.cholesky(Q)
    V = U + np.diag(np.sqrt(D))
    wanted = sla.solve_triangular(V, sla.solve_triangular(V, Q + np.diag(D), trans=1).T, trans=1).T

    preconditioner = CholeskyPlusRoot(U)
    preconditioner.update(rng.uniform(1, 2, 30))  # what an update leaves must not stay
    preconditioner.update(D)
    found = np.column_stack([preconditioner.multiply(e) for e in np.eye(30)])

    np.testing.assert_allclose(found, wanted, atol=1e-7 * abs(wanted).max())
    assert np.linalg.eigvalsh((found + found.T) / 2)[0] >= 0.5 - 1e-7
    v = rng.standard_normal(30)
    np.testing.assert_allclose(V @ preconditioner.from_transformed(v), v, atol=1e-8)
    np.testing.assert_allclose(V.T @ preconditioner.to_transformed(v), v, atol=1e-8)


def test_v_is_exact_without_d() -> None:
    preconditioner = CholeskyPlusRoot(sla.cholesky(definite(8, 1)))
    preconditioner.update(np.zeros(8))
    v = np.arange(1.0, 9.0)
    np.testing.assert_allclose(preconditioner.multiply(v), v)


def test_conjugate_gradients_end_after_as_many_steps_as_eigenvalues() -> None:
    H = np.diag([1.0, 1.0, 1.0, 4.0, 4.0, 9.0])
    b = np.arange(1.0, 7.0)
    result = conjugate_gradients(lambda v: H @ v, b, 1e-12, 100)
    assert result.converged
    assert result.iterations == 3
    np.testing.assert_allclose(result.z, b / np.diag(H), rtol=1e-10)


def test_conjugate_gradients_say_when_they_do_not_converge() -> None:
    H = definite(40, 0, condition=1e8)
    assert not conjugate_gradients(lambda v: H @ v, np.ones(40), 1e-12, 3).converged
    assert not conjugate_gradients(lambda v: -v, np.ones(4), 1e-12, 10).converged


@pytest.mark.parametrize("seed", range(6))
def test_the_method_solves_and_keeps_its_own_stopping_rule(seed: int) -> None:
    Q = definite(25, seed, condition=1e3)
    p = np.random.default_rng(seed).standard_normal(25)
    solver = Ipm()
    load = Load(np.zeros(0), np.zeros(0), p)
    answer = solver.solve((Q, CholeskyPlusRoot(sla.cholesky(Q))), load, 1e-14)

    assert answer.status == "solved"
    assert answer.details["mu"] <= 1e-14
    assert answer.details["infeasibility"] <= solver.feasibility
    np.testing.assert_allclose(answer.lam, by_nnls(Q, -p), atol=1e-6)
    counts = answer.details["cg"]
    assert len(counts["predictor"]) == len(counts["corrector"]) == answer.iterations
    assert sum(counts["predictor"]) + sum(counts["corrector"]) == answer.inner_iterations


def test_too_few_iterations_are_said() -> None:
    Q = definite(25, 0)
    load = Load(np.zeros(0), np.zeros(0), np.ones(25))
    answer = Ipm(max_iterations=2).solve((Q, CholeskyPlusRoot(sla.cholesky(Q))), load, 1e-14)
    assert answer.status == "iteration_limit"
    assert answer.iterations == 2


@pytest.mark.parametrize(
    ("option", "value"),
    [("theta", 0.0), ("theta", 1.0), ("cg_tolerance", 0.0), ("cg_tolerance", 1.0), ("feasibility", 0.0)],
)
def test_options_out_of_range_are_named(option: str, value: float) -> None:
    with pytest.raises(InputError, match=option):
        Ipm(**{option: value})
