"""The proven bounds against answers that are known exactly."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import scipy.linalg as sla
import scipy.sparse as sp
from lambda_min import proven

from harness.verification.certificate import certify
from harness.verification.exact_residual import DoubleDouble
from harness.verification.reference import refined_active_set
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.stiffness import dense
from problems.stiffness.operator import Stiffness

GROUPS, EACH = 40, 75  # random problems in all: their product


def whole(rng: np.random.Generator, *shape: int, low: int = -3, high: int = 4) -> np.ndarray:
    return rng.integers(low, high, shape).astype(float)


def manufactured(rng: np.random.Generator) -> tuple[Prepared, LoadCase, np.ndarray, np.ndarray]:
    """K, x*, λ*, y* in small dyadic numbers, so that f = Kx* + Aλ* and g = Aᵀx* + y* are exact.

    Of the contacts a random share has λ* = y* = 0. Two parts or three in a stack, some contacts against a
    rigid tool, and the stiffness of one part scaled by up to 2²⁰.
    """
    parts, size = int(rng.integers(2, 4)), int(rng.integers(1, 6))
    blocks = []
    for _ in range(parts):
        B = whole(rng, size, size)
        blocks.append(np.asfortranarray((B @ B.T + np.eye(size)) * 2.0 ** rng.integers(-10, 11)))
    columns = []
    for below in range(parts - 1):
        for k in range(size):
            column = np.zeros(parts * size)
            column[below * size + k] = 1.0
            column[(below + 1) * size + k] = -1.0
            columns.append(column)
    if rng.random() < 0.5:
        columns.append(np.eye(parts * size)[0])
    A = np.column_stack(columns)[:, : parts * size]
    m = A.shape[1]
    kind = rng.integers(0, 3, m)  # closed, weakly active, open
    lam = np.where(kind == 0, whole(rng, m, low=1, high=5), 0.0)
    y = np.where(kind == 2, whole(rng, m, low=1, high=5) / 8, 0.0)
    x = whole(rng, parts * size) / 16
    K = sla.block_diag(*blocks)
    load = LoadCase(K @ x + A @ lam, A.T @ x + y)
    Q = A.T @ np.linalg.solve(K, A)
    prepared = Prepared(
        Assembly(Stiffness.of(*blocks), sp.csc_array(A)), Q=lambda: np.asfortranarray((Q + Q.T) / 2)
    )
    return prepared, load, x, lam


@pytest.mark.parametrize("group", range(GROUPS))
def test_the_bound_holds_on_every_problem_with_a_known_answer(group: int) -> None:
    """Dyadic data make the answer exact, and degenerate contacts are made to order."""
    rng = np.random.default_rng(group)
    for _ in range(EACH):
        prepared, load, x, _ = manufactured(rng)
        found = refined_active_set(prepared, load)
        assert abs(found.x - x).max() <= found.bound_mm  # both sides are exact: x is dyadic and small
        assert found.bound_mm < 1e-10


@pytest.mark.parametrize("group", range(8))
def test_the_bound_of_any_point_holds(group: int) -> None:
    """x and λ far from the answer, infeasible and of the wrong sign: certify makes of them what it can."""
    rng = np.random.default_rng(100 + group)
    for _ in range(25):
        prepared, load, x, lam = manufactured(rng)
        kappa = 0.999 * min(np.linalg.eigvalsh(block)[0] for block in prepared.assembly.K.matrices)
        zero_x, zero_lam = np.zeros(len(x)), np.zeros(len(lam))
        for size in (1.0, 1e-3, 1e-9):
            near = DoubleDouble(x + size * rng.standard_normal(len(x)), zero_x)
            forces = DoubleDouble(lam + size * rng.standard_normal(len(lam)), zero_lam)
            active = rng.random(len(lam)) < 0.5
            proof = certify(prepared.assembly, load, near, forces, active, kappa)
            assert abs(proof.x.hi - x).max() <= proof.bound_mm


@pytest.mark.parametrize("group", range(8))
def test_what_is_proven_closed_or_open_is(group: int) -> None:
    rng = np.random.default_rng(200 + group)
    decided = 0
    for _ in range(25):
        prepared, load, x, lam = manufactured(rng)
        kappa = 0.999 * min(np.linalg.eigvalsh(block)[0] for block in prepared.assembly.K.matrices)
        y = load.g - prepared.assembly.A.T @ x
        proof = certify(
            prepared.assembly, load, DoubleDouble(x, 0 * x), DoubleDouble(lam, 0 * lam), lam > 0, kappa
        )
        assert (lam[proof.closed] > 0).all()
        assert (y[proof.open] > 0).all()
        assert not (proof.closed & proof.open).any()
        decided += int((proof.closed | proof.open).sum())
        assert (proof.closed | proof.open)[y > 0].all()
    assert decided > 50


def test_without_a_proof_of_definiteness_there_is_no_bound() -> None:
    prepared, load, x, lam = manufactured(np.random.default_rng(0))
    proof = certify(prepared.assembly, load, DoubleDouble(x, 0 * x), DoubleDouble(lam, 0 * lam), lam > 0, 0.0)
    assert proof.bound_mm == np.inf
    assert not (proof.closed | proof.open).any()


@pytest.mark.parametrize("condition", [1e1, 1e4, 1e8, 1e12])
@pytest.mark.parametrize("seed", range(5))
def test_the_smallest_eigenvalue_is_bounded_from_below(condition: float, seed: int) -> None:
    """K − κI is positive definite in rational arithmetic, and κ is not far below the estimate."""
    rng = np.random.default_rng(seed)
    size = 8
    basis = np.linalg.qr(rng.standard_normal((size, size)))[0]
    K = (basis * np.geomspace(1, condition, size)) @ basis.T
    K = (K + K.T) / 2
    kappa = proven(K, 0.9)
    assert kappa > (0.8 if condition < 1e11 else 0.05)
    rows = [[Fraction(float(v)) for v in row] for row in K]
    for i in range(size):
        rows[i][i] -= Fraction(kappa)
    for j in range(size):  # the pivots of an exact elimination
        assert rows[j][j] > 0
        for i in range(j + 1, size):
            factor = rows[i][j] / rows[j][j]
            rows[i] = [a - factor * b for a, b in zip(rows[i], rows[j], strict=True)]


def test_the_bound_does_not_grow_with_the_number_of_stiff_unknowns() -> None:
    """n = 1000, n u trace K = 1e-4: above λmin. The eigenvalues are those of a 2 × 2 matrix."""
    c = 3e-5
    K = np.kron(np.eye(500), [[1e6, 1e6 - c], [1e6 - c, 1e6]])
    assert 0.85 * c < proven(K, 0.9 * c) <= c


def test_the_norm_of_the_factors_is_bounded_from_above() -> None:
    R = np.asfortranarray(np.triu(np.random.default_rng(3).standard_normal((40, 40))) + 3 * np.eye(40))
    exact = np.linalg.norm(abs(R).T @ abs(R), 2)
    assert exact <= dense._norm(R.copy(order="F")) * (1 + 1e-14) <= 2 * exact


def test_an_indefinite_matrix_has_no_positive_bound() -> None:
    assert proven(np.diag([1.0, -1e-3]), 0.9) == 0.0
    assert proven(np.diag([1.0, 0.0]), 0.9) == 0.0


def test_a_bad_estimate_does_no_harm() -> None:
    K = np.diag([2.0, 5.0])
    assert 0 <= proven(K, 1e6) <= 2.0
    assert 0 < proven(K, 1e-9) <= 2.0


def test_the_bound_grows_with_the_residual() -> None:
    """A mutation of the load by δ is seen as a bound of at least the shift that it makes."""
    prepared, load, x, lam = manufactured(np.random.default_rng(5))
    kappa = 0.999 * min(np.linalg.eigvalsh(block)[0] for block in prepared.assembly.K.matrices)
    wrong = replace(load, f=load.f + 1.0)
    proof = certify(
        prepared.assembly, wrong, DoubleDouble(x, 0 * x), DoubleDouble(lam, 0 * lam), lam > 0, kappa
    )
    assert proof.bound_mm >= np.sqrt(len(x)) / np.sqrt(kappa * abs(prepared.assembly.K.matrices[0]).sum())
