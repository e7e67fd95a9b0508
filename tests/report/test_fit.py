"""Exponents of growth against SciPy's regression."""

import math

import numpy as np
import pytest
from scipy.stats import linregress

from report.analysis.roads import exponent


def test_exponents_of_known_powers() -> None:
    sizes = [1170.0, 2522.0, 4386.0, 6762.0, 11308.0]
    exact = exponent(sizes, [3e-7 * n**2.5 for n in sizes])
    assert exact is not None
    assert (exact.slope, exact.error) == pytest.approx((2.5, 0.0), abs=1e-9)
    noisy = [n**2 * f for n, f in zip(sizes, (1.1, 0.8, 1.3, 0.9, 1.0), strict=True)]
    fit, other = exponent(sizes, noisy), linregress(np.log(sizes), np.log(noisy))
    assert fit is not None
    assert (fit.slope, fit.error) == pytest.approx((other.slope, other.stderr))
    assert exponent(sizes, [1.0, 2.0, math.nan, 0.0, math.nan]) is None
