"""Terms of the smallest eigenvalue's lower bound, each where it dominates, for a dense block and a band.

The errors are exact: in closed form, or in rational numbers. `mutate_proofs.py` takes the terms out in turn.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from lambda_min import proven

from problems.stiffness.rounding import U, gamma

pytestmark = pytest.mark.parametrize("kind", [np.asfortranarray, sp.csc_array])
Kind = Callable[[Any], Any]


@pytest.mark.parametrize("n", [1, 2, 5, 40])
@pytest.mark.parametrize("c", [1e-10, 1e-6])
@pytest.mark.parametrize("blocks", [1, 3])
def test_the_margin_is_that_of_the_theorem(kind: Kind, n: int, c: float, blocks: int) -> None:
    """K = 11ᵀ + cI: |R|ᵀ|R| = B, and ‖B‖₂ = n. Of three such in one band, no sum has more than n terms."""
    if blocks > 1 and kind is np.asfortranarray:
        pytest.skip("sums of a dense block are as long as the block")
    K = sp.block_diag([np.ones((n, n)) + c * np.eye(n)] * blocks).toarray()
    s = 0.9 * c
    margin = Fraction(s) - Fraction(proven(kind(K), s))
    theorem = Fraction(gamma(2 * (n + 1))) * n + Fraction(U)
    assert Fraction(1009, 1000) <= margin / theorem <= Fraction(1013, 1000)


def test_a_matrix_that_completes_by_rounding_is_not_taken_for_definite(kind: Kind) -> None:
    """λmin = c exactly, s just above it, and the factorisation of the indefinite K − sI completes."""
    completed = 0
    for seed in range(60):
        v = np.random.default_rng(seed).integers(2**19, 2**20, 2).astype(float)
        c = 2.0**-13  # below a rounding of the entries of vvᵀ, up to 2⁴⁰
        K = np.outer(v, v) + c * np.eye(2)
        s = 1.01 * c
        try:
            np.linalg.cholesky(K - s * np.eye(2))
        except np.linalg.LinAlgError:
            continue
        completed += 1
        assert proven(kind(K), s) <= c
    assert completed > 5


@pytest.mark.parametrize(("K", "norm"), [([[1.0, -0.9], [-0.9, 1.0]], 1.9), ([[1.0, 0.0], [0.0, 0.01]], 1.0)])
def test_the_norm_is_the_largest_and_of_sizes(kind: Kind, K: list[list[float]], norm: float) -> None:
    """‖|R|ᵀ|R|‖₂, where K itself has 1.9 as well; and where the rows of R differ."""
    s, terms = 1e-3, 2 if kind is np.asfortranarray or K[0][1] else 1
    theorem = Fraction(gamma(2 * (terms + 1))) * Fraction(norm) + Fraction(U) * Fraction(1.0 - s)
    assert Fraction(s) - Fraction(proven(kind(np.array(K)), s)) >= Fraction(1005, 1000) * theorem


def test_the_rounding_of_the_difference_counts(kind: Kind) -> None:
    """n = 1: the theorem's margin is 5u (1 − s), and s − margin is rounded by up to us/2."""
    for k in range(100):
        K = 1 + k / 128
        for s in (0.9 * K, 0.5 * K):
            margin = Fraction(s) - Fraction(proven(kind(np.full((1, 1), K)), s))
            assert margin >= (Fraction(gamma(4)) + Fraction(U)) * (Fraction(K) - Fraction(s))


@pytest.mark.parametrize("exponent", [-990, -500, 500, 1000])
def test_in_any_unit(kind: Kind, exponent: int) -> None:
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    usual, scaled = proven(kind(K), 0.9), proven(kind(np.ldexp(K, exponent)), np.ldexp(0.9, exponent))
    assert scaled == np.ldexp(usual, exponent)
    assert proven(kind(np.ldexp(K, -1040)), 2.0**-1040) == 0.0
    assert proven(kind(np.diag([2.0**-995, 2.0**-1010])), 2.0**-1010) == 0.0


def test_a_factorisation_that_stops_proves_nothing(kind: Kind) -> None:
    """λmin = 3: shares of the guess above it are passed over."""
    K = kind(np.array([[4.0, 1.0], [1.0, 4.0]]))
    assert proven(K, 2.0**9) == 0.0
    assert 1.9 < proven(K, 10.0) <= 2.0
