"""Many right-hand sides at once through a band factor, against LAPACK's one by one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import lapack

from problems.stiffness.band_solve import FEW, PANEL, band_solve


@pytest.mark.parametrize("width", [PANEL, PANEL + 1, 100, 2 * PANEL, 200])
@pytest.mark.parametrize("size", [1, 50, 100, 201, 202, 300, 777, 1024])
def test_the_same_as_one_by_one(width: int, size: int) -> None:
    """Sizes with a last panel that is shorter, and matrices smaller than their band."""
    random = np.random.default_rng(size)
    L = np.asfortranarray(random.uniform(-1, 1, (width + 1, size)) / width)
    L[0] = 1.0 + random.random(size)
    B = random.standard_normal((size, FEW + 3))
    X = band_solve(L, B)
    one_by_one = np.column_stack([lapack.dpbtrs(L, column, lower=1)[0] for column in B.T])
    np.testing.assert_allclose(X, one_by_one, rtol=1e-12, atol=1e-12 * abs(one_by_one).max())


def test_the_right_hand_sides_are_left_as_they_are() -> None:
    L = np.asfortranarray(np.vstack([np.full(300, 2.0), np.full((PANEL, 300), 1e-3)]))
    for order in "CF":
        B = np.array(np.random.default_rng(0).standard_normal((300, 9)), order=order)
        before = B.copy()
        band_solve(L, B)
        np.testing.assert_array_equal(B, before)
