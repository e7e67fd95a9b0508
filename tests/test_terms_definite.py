"""Terms of the smallest eigenvalue's lower bound, each where it dominates.

The errors are exact: in closed form, or in rational numbers. `mutate_proofs.py` takes the terms out in turn.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from harness.verification import definite
from harness.verification.definite import smallest_eigenvalue
from harness.verification.exact_residual import (
    U,
    gamma,
)


@pytest.mark.parametrize("n", [1, 2, 5, 40])
@pytest.mark.parametrize("c", [1e-10, 1e-6])
def test_definite_the_margin_is_that_of_the_theorem(n: int, c: float) -> None:
    """K = 11ᵀ + cI: |R|ᵀ|R| = B, and ‖B‖₂ = n."""
    K = np.ones((n, n)) + c * np.eye(n)
    s = Fraction(definite.SHARES[0] * c)
    margin = s - Fraction(smallest_eigenvalue(K, c))
    theorem = Fraction(gamma(2 * (n + 1))) * n + Fraction(U)
    assert Fraction(1009, 1000) <= margin / theorem <= Fraction(1013, 1000)


def test_definite_a_matrix_that_completes_by_rounding_is_not_taken_for_definite() -> None:
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
        assert smallest_eigenvalue(K, s / definite.SHARES[0]) <= c
    assert completed > 5


@pytest.mark.parametrize(("K", "norm"), [([[1.0, -0.9], [-0.9, 1.0]], 1.9), ([[1.0, 0.0], [0.0, 0.01]], 1.0)])
def test_definite_the_norm_is_the_largest_and_of_sizes(K: list[list[float]], norm: float) -> None:
    """‖|R|ᵀ|R|‖₂, where K itself has 1.9 as well; and where the rows of R differ."""
    s = Fraction(definite.SHARES[0] * 1e-3)
    theorem = Fraction(gamma(6)) * Fraction(norm) + Fraction(U) * Fraction(1.0 - float(s))
    assert s - Fraction(smallest_eigenvalue(np.array(K), 1e-3)) >= Fraction(1005, 1000) * theorem


def test_definite_the_rounding_of_the_difference_counts() -> None:
    """n = 1: the theorem's margin is 5u (1 − s), and s − margin is rounded by up to us/2."""
    for k in range(100):
        K = 1 + k / 128
        s = definite.SHARES[0] * K
        margin = Fraction(s) - Fraction(smallest_eigenvalue(np.full((1, 1), K), K))
        largest = Fraction(K) - Fraction(s)
        assert margin >= (Fraction(gamma(4)) + Fraction(U)) * largest


@pytest.mark.parametrize("exponent", [-990, -500, 500, 1000])
def test_definite_in_any_unit(exponent: int) -> None:
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    usual, scaled = smallest_eigenvalue(K, 1.0), smallest_eigenvalue(np.ldexp(K, exponent), 2.0**exponent)
    assert scaled == np.ldexp(usual, exponent)
    assert smallest_eigenvalue(np.ldexp(K, -1040), 2.0**-1040) == 0.0
    assert smallest_eigenvalue(np.diag([2.0**-995, 2.0**-1010]), 2.0**-1010) == 0.0


def test_definite_a_factorisation_that_stops_proves_nothing() -> None:
    """λmin = 3: shares of the estimate above it are passed over."""
    K = np.array([[4.0, 1.0], [1.0, 4.0]])
    assert smallest_eigenvalue(K, 2.0**9) == 0.0
    assert 1.9 < smallest_eigenvalue(K, 4.0) < 2.0
