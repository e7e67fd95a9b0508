"""Residuals of a sparse K for several load cases at once, against rational arithmetic and one by one."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import scipy.sparse as sp

from harness.verification.exact_residual import DoubleDouble, forces, gaps
from harness.verification.sliced_forces import SlicedForces
from problems.forms.assembly import Assembly
from problems.stiffness.operator import Stiffness


def assembly(random: np.random.Generator) -> Assembly:
    """Two positive definite blocks in units of every size, contacts between them, one of three entries."""
    blocks = []
    for size in (9, 7):
        B = random.standard_normal((size, size)) * (random.random((size, size)) < 0.4)
        units = 10.0 ** random.uniform(-6, 6, size)
        blocks.append(sp.csc_array((B @ B.T + np.eye(size)) * np.outer(units, units)))
    A = np.zeros((16, 5))
    A[np.arange(5), np.arange(5)], A[9 + np.arange(5), np.arange(5)] = 1.0, -0.3
    A[15, 2] = 1e-3
    return Assembly(Stiffness.of(*(sp.csc_array((K + K.T) / 2) for K in blocks)), sp.csc_array(A))


def doubled(random: np.random.Generator, *shape: int) -> DoubleDouble:
    hi = random.standard_normal(shape) * 10.0 ** random.uniform(-8, 4, shape)
    return DoubleDouble(hi, hi * random.uniform(-1e-16, 1e-16, shape))


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("shared", [False, True])
def test_residuals_lie_within_their_bounds(seed: int, shared: bool) -> None:
    random = np.random.default_rng(seed)
    made, k = assembly(random), 3
    D = made.K.units[:, None]
    x, lam = doubled(random, 16, k), doubled(random, 5, k)
    x = DoubleDouble(x.hi * D, x.lo * D)
    f = random.standard_normal((16, 1 if shared else k)) * 10.0 ** random.uniform(-8, 8, (16, 1))
    found = SlicedForces(made, D)(f, x, lam)
    whole = sp.block_diag(made.K.matrices).toarray(), made.A.toarray()
    factors = [[[Fraction(float(v.hi[i, c])) + Fraction(float(v.lo[i, c])) for i in range(len(v.hi))]
                for c in range(k)] for v in (x, lam)]  # fmt: skip
    for column in range(k):
        for row in range(16):
            exact, size = Fraction(float(f[row, 0 if shared else column])), 0.0
            for M, values in zip(whole, factors, strict=True):
                exact -= sum(Fraction(float(a)) * v for a, v in zip(M[row], values[column], strict=True))
                size = max(size, abs(M[row] @ np.diag([float(abs(v)) for v in values[column]])).max())
            value, error = found.value[row, column], found.error[row, column]
            assert abs(Fraction(float(value)) - exact) <= Fraction(float(error))
            largest = max(size, abs(x.hi[:, column] / D[:, 0]).max() / D[row, 0])
            assert error <= 1e-26 * largest + 2e-16 * abs(value)


def test_columns_are_the_residuals_of_each() -> None:
    random = np.random.default_rng(0)
    made, k = assembly(random), 4
    D = made.K.units[:, None]
    x, lam = doubled(random, 16, k), doubled(random, 5, k)
    f, g = random.standard_normal((16, k)), random.standard_normal((5, k))
    r, s = SlicedForces(made, D)(f, x, lam), gaps(made, g, x)
    for column in range(k):
        x_k, lam_k = (DoubleDouble(v.hi[:, column], v.lo[:, column]) for v in (x, lam))
        of_one = forces(made, f[:, column], x_k, lam_k)
        assert (abs(r.value[:, column] - of_one.value) <= r.error[:, column] + of_one.error).all()
        np.testing.assert_array_equal(s.value[:, column], gaps(made, g[:, column], x_k).value)
        np.testing.assert_array_equal(s.error[:, column], gaps(made, g[:, column], x_k).error)


def test_the_rounding_of_the_smallest_products_counts() -> None:
    """Rows so long, and forces so well balanced, that nothing else is left of the error."""
    random, n = np.random.default_rng(3), 500
    B = random.random((n, n))
    K = sp.csc_array((B + B.T) / 2 + n * np.eye(n))
    made = Assembly(Stiffness.of(K), sp.csc_array((n, 1)))
    x, D, nothing = random.random((n, 1)), made.K.units[:, None], np.zeros((1, 1))
    f = K @ x
    for _ in range(3):
        found = SlicedForces(made, D)(f, DoubleDouble(x, 0 * x), DoubleDouble(nothing, nothing))
        balanced, f = f, f - found.value
    whole, exactly = K.toarray(), [Fraction(float(value)) for value in x[:, 0]]
    for row in range(0, n, 20):
        products = (Fraction(float(a)) * v for a, v in zip(whole[row], exactly, strict=True))
        off = Fraction(float(balanced[row, 0])) - sum(products) - Fraction(float(found.value[row, 0]))
        assert abs(off) <= Fraction(float(found.error[row, 0]))
