"""Residuals against rational arithmetic: the error bounds hold, and are small."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import scipy.sparse as sp

from harness.verification.exact_residual import DoubleDouble, Enclosure, forces, gaps, two_product, two_sum
from problems.forms.assembly import Assembly
from problems.stiffness.operator import Stiffness


def exactly(v: np.ndarray) -> list[Fraction]:
    return [Fraction(float(value)) for value in v]


def total(*parts: list[Fraction]) -> list[Fraction]:
    return [sum(values, Fraction(0)) for values in zip(*parts, strict=True)]


def times(M: np.ndarray, v: list[Fraction]) -> list[Fraction]:
    return [sum((Fraction(float(a)) * b for a, b in zip(row, v, strict=True)), Fraction(0)) for row in M]


def assert_encloses(found: Enclosure, wanted: list[Fraction], size: float) -> None:
    for value, error, exact in zip(found.value, found.error, wanted, strict=True):
        assert abs(Fraction(float(value)) - exact) <= Fraction(float(error))
    assert found.error.max() <= 1e-24 * size + 3e-16 * abs(found.value).max()


def wild(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Entries of very different size."""
    return rng.standard_normal(shape) * 10.0 ** rng.uniform(-8, 4, shape)


def doubled(rng: np.random.Generator, size: int) -> DoubleDouble:
    hi = wild(rng, size)
    return DoubleDouble(hi, hi * rng.uniform(-1e-16, 1e-16, size))


def small_assembly(rng: np.random.Generator) -> Assembly:
    """Three parts in a stack and random contacts between them, one of three entries."""
    blocks = []
    for size in (5, 6, 4):
        B = wild(rng, size, size)
        blocks.append(np.asfortranarray(B + B.T))
    A = np.zeros((15, 7))
    for k in range(7):
        A[k, k] = 1.0
        A[7 + k, k] = -1.0
    A[14, 3] = 0.3
    return Assembly(Stiffness.of(*blocks), sp.csc_array(A))


@pytest.mark.parametrize("seed", range(40))
def test_residuals_lie_within_their_bounds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    made = small_assembly(rng)
    A = made.A.toarray()
    x, lam, f, g = doubled(rng, 15), doubled(rng, 7), wild(rng, 15), wild(rng, 7)
    x_exact, lam_exact = (total(exactly(v.hi), exactly(v.lo)) for v in (x, lam))
    K = np.zeros((15, 15))
    for block, rows in zip(made.K.matrices, made.K.slices, strict=True):
        K[rows, rows] = block
    Kx, Al, Ax = times(K, x_exact), times(A, lam_exact), times(A.T, x_exact)
    r = [a - b - c for a, b, c in zip(exactly(f), Kx, Al, strict=True)]
    s = [a - b for a, b in zip(exactly(g), Ax, strict=True)]
    assert_encloses(forces(made, f, x, lam), r, 1e12)
    assert_encloses(gaps(made, g, x), s, 1.0)


@pytest.mark.parametrize("seed", range(3))
def test_a_residual_that_cancels_is_still_known(seed: int) -> None:
    """f is Kx rounded: what is left is below one rounding of f, and known to many digits."""
    rng = np.random.default_rng(seed)
    size = 300
    B = rng.standard_normal((size, size))
    K = np.asfortranarray(B + B.T) * 1e5
    made = Assembly(Stiffness.of(K), sp.csc_array((size, 1)))
    x = rng.standard_normal(size)
    nothing = np.zeros(1)
    f = K @ x
    found = forces(made, f, DoubleDouble(x, np.zeros(size)), DoubleDouble(nothing, nothing))
    exact = [a - b for a, b in zip(exactly(f), times(K, exactly(x)), strict=True)]
    assert_encloses(found, exact, 1e6)
    assert 0 < abs(found.value).max() < 1e-7
    assert found.error.max() < 1e-9 * abs(found.value).max()


def test_sums_and_products_come_with_their_roundings() -> None:
    rng = np.random.default_rng(0)
    a, b = wild(rng, 1000), wild(rng, 1000)
    for operation, exact in ((two_sum, lambda p, q: p + q), (two_product, lambda p, q: p * q)):
        for p, q, value, rounding in zip(a, b, *operation(a, b), strict=True):
            assert Fraction(value) + Fraction(rounding) == exact(Fraction(p), Fraction(q))


def test_a_correction_is_added_without_loss() -> None:
    x = DoubleDouble(np.array([1.0]), np.array([1e-20]))
    x = x.plus(np.array([1e-17]))
    assert x.hi[0] == 1.0
    assert x.lo[0] == pytest.approx(1.001e-17, rel=1e-12)
