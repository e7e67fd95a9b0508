"""Proofs where there is no M, from forces that are a thousandth off: answers of known integers."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse as sp

from harness.verification import proof as proofs
from harness.verification.reference import proof_of
from harness.verification.sprung_contacts import SprungContacts, SprungFactors
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.compliance import ApproximateInverse
from problems.forms.prepared import Prepared
from problems.ladders.outside import five_point
from problems.stiffness.operator import Stiffness

PRODUCTS = 4  # of conjugate gradients in a pass: springs leave few

Matrices = tuple[sp.csc_array, sp.csc_array]


def convex(n: int = 600) -> Matrices:
    """Regression by a convex sequence: cond(Q) about n⁴."""
    return sp.csc_array(sp.eye_array(n)), sp.csc_array(
        sp.diags_array([1.0, -2.0, 1.0], offsets=[0, -1, -2], shape=(n, n - 2))
    )


def squared_membrane(side: int = 15) -> Matrices:
    L = five_point(side)
    return sp.csc_array(L @ L + 2.0**-20 * sp.eye_array(side**2)), sp.csc_array(sp.eye_array(side**2))


def slender_strips(n: int = 120) -> Matrices:
    """Two beams, cond(K) about n⁴, a contact at each node: k_ii tells nothing of q_ii."""
    bent = sp.diags_array([1.0, -2.0, 1.0], offsets=[0, -1, -2], shape=(n + 2, n))
    beam = bent.T @ bent + sp.csc_array(([1.0], ([0], [0])), shape=(n, n))
    one = sp.eye_array(n)
    return sp.csc_array(sp.block_diag([beam, 4 * beam])), sp.csc_array(sp.vstack([one, -one]))


def problem(matrices: Matrices) -> tuple[Prepared, LoadCase, np.ndarray, np.ndarray]:
    """A third of the contacts closed, a third closed without a force; x* and λ* in integers."""
    K, A = matrices
    n, m = A.shape
    rng = np.random.default_rng(n)
    x, of = rng.integers(-(2**10), 2**10, n).astype(float), rng.permutation(m) % 3
    lam = np.where(of == 0, rng.integers(1, 2**10, m), 0).astype(float)
    y = np.where(of == 2, rng.integers(1, 2**10, m), 0)
    return Prepared(Assembly(Stiffness.of(K), A)), LoadCase(K @ x + A @ lam, A.T @ x + y), x, lam


@pytest.mark.parametrize("make", [convex, squared_membrane, slender_strips])
@pytest.mark.parametrize("noise", [1e-9, 1e-3])
def test_forces_are_refined_to_rounding_in_few_steps(
    make: Callable[[], Matrices], noise: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Several load cases, each with its own set, in few passes and few solutions in each."""
    data, load, x, lam = problem(make())
    none = ApproximateInverse(None, data.assembly.A.power(2).T @ (1 / data.assembly.K.diagonal))
    monkeypatch.setattr(Prepared, "approximate_inverse", none)
    monkeypatch.setattr(proofs, "MAX_PRODUCTS", PRODUCTS)
    off = 1 + noise * np.random.default_rng(1).standard_normal((2, len(lam)))
    for found in proof_of(data).proven([load] * 2, list(lam * off)):
        assert abs(found.x.hi - x).max() <= found.bound_mm <= 1e-11
        np.testing.assert_allclose(found.lam.hi, lam, atol=1e-8 * lam.max())


def test_the_first_step_takes_the_forces_of_open_contacts_away() -> None:
    """dλ_N = −λ_N, and from it y_C + (Q dλ)_C = −dλ_C/ρ, with K = I."""
    random = np.random.default_rng(3)
    A = sp.csc_array(random.standard_normal((9, 5)))
    units = proof_of(Prepared(Assembly(Stiffness.of(sp.csc_array(sp.eye_array(9))), A))).balanced
    springs, Q = SprungFactors(units, 2.0**-30), units.A.T @ units.A
    y, lam = np.array([0.1, 0.2, 0.15, 40.0, 50.0]), random.uniform(1.0, 2.0, 5)
    first = SprungContacts(springs, y, lam, np.ones(5))
    assert (~first.C).any()
    np.testing.assert_array_equal(first.dlam[~first.C], -lam[~first.C])
    left = (y + Q @ first.dlam + first.dlam / springs.rho)[first.C]
    np.testing.assert_allclose(left, 0.0, atol=1e-9)


@pytest.mark.parametrize("n", [14, 20])
def test_almost_dependent_contacts_of_a_dense_stiffness_are_proven(n: int) -> None:
    """A is unit upper triangular with −2 above the diagonal: independent, but λmin(AᵀA) is below 3⁻ⁿ."""
    A = np.eye(n) - 2 * np.triu(np.ones((n, n)), 1)
    random = np.random.default_rng(n)
    x, lam = random.integers(-9, 9, n).astype(float), random.integers(0, 9, n) * (np.arange(n) % 2.0)
    load = LoadCase(x + A @ lam, A.T @ x + np.where(lam > 0, 0, random.integers(0, 9, n)))
    proof = proof_of(Prepared(Assembly(Stiffness.of(np.eye(n)), sp.csc_array(A))))
    assert not proof.balanced.assembly.dependent
    assert proof.balanced.sigma2 == 0
    (found,) = proof.proven([load], [lam * (1 + 1e-9)])
    assert abs(found.x.hi - x).max() <= found.bound_mm <= 1e-8
