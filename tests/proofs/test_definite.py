"""Terms of the smallest eigenvalue's lower bound, each where it dominates, for a dense block and a band.

The errors are exact: in closed form, or in rational numbers. `mutate_proofs.py` takes the terms out in turn.
"""

from collections.abc import Callable
from fractions import Fraction
from math import lcm
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from sparse_matrices import band_matrix, chain, graph_matrix

from harness.verification import balanced_units
from harness.verification.balanced_units import independence, smallest_eigenvalue
from problems.forms.assembly import Matrix, Vector
from problems.stiffness import U, gamma
from problems.stiffness.block import NotPositiveDefinite
from problems.stiffness.cholmod import Cholmod
from problems.stiffness.dense_block import DenseBlock
from problems.stiffness.operator import Stiffness
from problems.stiffness.sparse_block import GeneralBlock, sparse_block
from problems.stiffness.superlu import SuperLU

KINDS = pytest.mark.parametrize("kind", [np.asfortranarray, sp.csc_array])
Kind = Callable[[Any], Any]


def proven(K: Any, guess: float) -> float:
    """The bound of one matrix in its own units, from a guess."""
    return smallest_eigenvalue(Stiffness.of(K), np.ones(K.shape[0]), [guess])


def proven_in_units(K: Stiffness, D: Vector) -> float:
    """Of DKD, from half of an estimate that is no smaller; 0 for a K that is not positive definite."""
    try:
        guesses = [about / 2 for about in K.least_eigenvalues(D)]
    except NotPositiveDefinite:
        return 0.0
    return smallest_eigenvalue(K, D, guesses)


@pytest.mark.parametrize("n", [1, 2, 5, 40])
@pytest.mark.parametrize("c", [1e-10, 1e-6])
@pytest.mark.parametrize(("kind", "blocks"), [(np.asfortranarray, 1), (sp.csc_array, 1), (sp.csc_array, 3)])
def test_the_margin_is_that_of_the_theorem(kind: Kind, n: int, c: float, blocks: int) -> None:
    """K = 11ᵀ + cI: |R|ᵀ|R| = B, and ‖B‖₂ = n. Of three such in one band, no sum has more than n terms."""
    K = sp.block_diag([np.ones((n, n)) + c * np.eye(n)] * blocks).toarray()
    s = 0.9 * c
    margin = Fraction(s) - Fraction(proven(kind(K), s))
    theorem = Fraction(gamma(2 * (n + 1))) * n + Fraction(U)
    assert Fraction(1009, 1000) <= margin / theorem <= Fraction(1013, 1000)


@pytest.mark.parametrize(("K", "norm"), [([[1.0, -0.9], [-0.9, 1.0]], 1.9), ([[1.0, 0.0], [0.0, 0.01]], 1.0)])
@KINDS
def test_the_norm_is_the_largest_and_of_sizes(kind: Kind, K: list[list[float]], norm: float) -> None:
    """‖|R|ᵀ|R|‖₂, where K itself has 1.9 as well; and where the rows of R differ."""
    s, terms = 1e-3, 2 if kind is np.asfortranarray or K[0][1] else 1
    theorem = Fraction(gamma(2 * (terms + 1))) * Fraction(norm) + Fraction(U) * Fraction(1.0 - s)
    assert Fraction(s) - Fraction(proven(kind(np.array(K)), s)) >= Fraction(1005, 1000) * theorem


@KINDS
def test_the_rounding_of_the_difference_counts(kind: Kind) -> None:
    """n = 1: the theorem's margin is 5u (1 − s), and s − margin is rounded by up to us/2."""
    for k in range(100):
        K = 1 + k / 128
        for s in (0.9 * K, 0.5 * K):
            margin = Fraction(s) - Fraction(proven(kind(np.full((1, 1), K)), s))
            assert margin >= (Fraction(gamma(4)) + Fraction(U)) * (Fraction(K) - Fraction(s))


@pytest.mark.parametrize("exponent", [-990, -500, 500, 1000])
@KINDS
def test_in_any_unit(kind: Kind, exponent: int) -> None:
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    usual, scaled = proven(kind(K), 0.9), proven(kind(np.ldexp(K, exponent)), np.ldexp(0.9, exponent))
    assert scaled == np.ldexp(usual, exponent)
    assert proven(kind(np.ldexp(K, -1040)), 2.0**-1040) == 0.0
    assert proven(kind(np.diag([2.0**-995, 2.0**-1010])), 2.0**-1010) == 0.0


@KINDS
def test_a_factorisation_that_stops_proves_nothing(kind: Kind) -> None:
    """λmin = 3: shares of the guess above it are passed over."""
    K = kind(np.array([[4.0, 1.0], [1.0, 4.0]]))
    assert proven(K, 2.0**9) == 0.0
    assert 1.9 < proven(K, 10.0) <= 2.0


def is_semidefinite(K: Matrix, D: Vector, kappa: float) -> bool:
    """Whether no eigenvalue of DKD − κI is negative: by its leading minors, in whole numbers (Bareiss)."""
    S = [
        [Fraction(k) * Fraction(a) * Fraction(b) for k, a in zip(row, D, strict=True)]
        for row, b in zip(K, D, strict=True)
    ]
    for i in range(len(S)):
        S[i][i] -= Fraction(kappa)
    one = lcm(*(value.denominator for row in S for value in row))
    minors, last = [[int(value * one) for value in row] for row in S], 1
    for k, top in enumerate(minors):
        if top[k] < 0 or (top[k] == 0 and any(top[k + 1 :])):
            return False
        if top[k]:
            for row in minors[k + 1 :]:
                factor = row[k]
                row[k:] = [(top[k] * a - factor * b) // last for a, b in zip(row[k:], top[k:], strict=True)]
            last = top[k]
    return True


LIBRARIES = pytest.mark.parametrize("library", [SuperLU, Cholmod])


@pytest.mark.parametrize("n", [1, 2, 5, 40])
@LIBRARIES
def test_the_margin_of_a_general_factor_is_that_of_the_theorem(library: Any, n: int) -> None:
    """K = 11ᵀ + cI in units of 2⁻¹⁰: |L||U| and |L||L|ᵀ are K, whose norm is n 2²⁰."""
    K = 2.0**20 * (np.ones((n, n)) + 1e-6 * np.eye(n))
    error = Fraction(library(sp.csc_array(K), 0.0).backward_error())
    assert 1 <= error / (Fraction(gamma(2 * (n + 2))) * n * 2**20) <= Fraction(6, 5)


@pytest.mark.parametrize("seed", range(10))
@LIBRARIES
def test_a_general_factor_proves_it_as_well(library: Any, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(GeneralBlock, "make_factor", staticmethod(library))
    nearly_singular(seed, lambda K: GeneralBlock(K, K.shape[0]))


@pytest.mark.parametrize("seed", range(20))
def test_lambda_min_is_proven_for_matrices_that_are_nearly_singular(seed: int) -> None:
    nearly_singular(seed, sparse_block)


def nearly_singular(seed: int, block: Callable[[sp.csc_array], Any]) -> None:
    """λmin from 1e-2 down to what rounding leaves, and below zero: κ is never above it."""
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 11))
    K = band_matrix(random, n, int(random.integers(0, 4)))
    D = Stiffness.of(K).units
    least = float(np.linalg.eigvalsh(D[:, None] * K.toarray() * D)[0])
    proven = []
    for left in (1e-2, 1e-5, 1e-8, 1e-12, 1e-15, 1e-16, 0.0, -1e-16):
        near = sp.csc_array(K - sp.diags_array((least - left) / D**2))
        held = Stiffness([block(near)])
        units = held.units
        kappa = proven_in_units(held, units)
        if kappa > 0:
            assert is_semidefinite(near.toarray(), units, kappa)
            assert not is_semidefinite(near.toarray(), units, 16 * kappa)
        proven.append(kappa > 0)
    assert proven[:4] == [True] * 4


def test_the_softest_block_counts_and_a_general_one_too() -> None:
    random = np.random.default_rng(2)
    blocks = (sp.csc_array(3 * (chain(40) + 2.0**-12 * sp.eye_array(40))), graph_matrix(random, 400))
    for order in (blocks, blocks[::-1]):
        held = Stiffness.of(*order)
        assert 0.3 * 2.0**-12 <= proven_in_units(held, held.units) <= 0.75 * 2.0**-12


def test_independence_of_contacts() -> None:
    """Two parts: 2. A chain of three parts: AᵀA = [[2, −1], [−1, 2]] at each node, 1. A tool: 1."""
    eye = sp.eye_array(4)
    pair = sp.csc_array(sp.vstack([eye, -eye]))
    chain = sp.csc_array(sp.block_array([[eye, None], [-eye, eye], [None, -eye]]))
    for A, wanted in ((pair, 2.0), (chain, 1.0), (sp.csc_array(eye), 1.0)):
        assert 0.8 * wanted <= independence(A) <= wanted
    assert independence(sp.csc_array(sp.hstack([eye, eye]))) == 0.0


def test_independence_counts_the_rounding_of_long_sums(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(balanced_units, "SHARE", 1 - 2.0**-50)  # so that nothing else is left to spare
    for entry in (0.1, 0.7, 1.1):
        found = independence(sp.csc_array(np.full((4096, 1), entry)))
        assert 0 < Fraction(found) <= 4096 * Fraction(entry) ** 2


def test_independence_counts_the_rounding_of_its_products() -> None:
    a = np.array([[0.1, 0.3], [0.7, 0.9], [0.2, 0.4]])
    G = [[sum(Fraction(p) * Fraction(q) for p, q in zip(u, v, strict=True)) for v in a.T] for u in a.T]
    sigma2 = Fraction(independence(sp.csc_array(a)))
    assert (G[0][0] - sigma2) * (G[1][1] - sigma2) >= G[0][1] ** 2
    nearly = np.array([[1.0, 1.0], [0.0, 2.0**-20]])  # λmin(AᵀA) is 2⁻⁴¹, a product is rounded by 2⁻⁵³
    assert 0 < independence(sp.csc_array(nearly)) <= 2.0**-41
    assert independence(sp.csc_array(nearly * [[1.0], [2.0**-4]])) == 0.0  # 2⁻⁴⁹


def test_compliance_the_backward_error_of_the_factor_counts() -> None:
    """(K⁻¹)_ii ≤ (1 + e/κ) (UᵀU)⁻¹_ii, e/κ one hundredth here and then more."""
    K = DenseBlock(np.diag([1.0, 2.0**40]).T)
    rounding, ones = gamma(6), np.ones(2)
    for share in (0.01, 1.0, 100.0):
        kappa = rounding * (1 + 2.0**40) / share
        assert 1 + share <= K.largest_compliance(ones, kappa) <= 1.02 * (1 + 1.02 * share)
    D = np.array([1.0, 2.0**-20])  # DKD = I
    assert 2.0 <= K.largest_compliance(D, 2 * rounding) <= 2.1
    assert K.largest_compliance(ones, 0.0) == np.inf


def test_compliance_the_error_of_the_inverse_counts() -> None:
    """ε ‖X‖_F is what any row of X may be off by: 9 % of 1 here."""
    epsilon, ones = gamma(6) * 2.0**47, np.ones(2)
    found = DenseBlock(np.diag([1.0, 2.0**94]).T).largest_compliance(ones, 1e30)
    assert 1.0099 * (1 + epsilon) ** 2 <= found <= 1.05 * (1 + epsilon) ** 2
    assert DenseBlock(np.diag([1.0, 2.0**110]).T).largest_compliance(ones, 1e30) == np.inf


def test_compliance_is_the_square_of_a_row() -> None:
    assert 4.0 <= DenseBlock(np.full((1, 1), 0.25)).largest_compliance(np.ones(1), 0.25) <= 4.2
    rng = np.random.default_rng(0)
    B = rng.standard_normal((40, 40))
    K = np.asfortranarray(B @ B.T + np.eye(40))
    wanted = np.diag(np.linalg.inv(K)).max()
    found = DenseBlock(K).largest_compliance(np.ones(40), float(np.linalg.eigvalsh(K)[0]))
    assert wanted <= found <= 1.05 * wanted
