"""The speed of the machine beside each solve: a Cholesky factorisation of Q and a product Qv."""

from __future__ import annotations

import time
from statistics import median

import numpy as np
from scipy.linalg import lapack

from problems.forms.assembly import Matrix

REPEATS = 3


def yardstick(Q: Matrix) -> dict[str, float]:
    """Seconds of each, median of three: m³/3 operations, and one pass over 8m² bytes."""
    v = np.ones(len(Q))
    factor, product = [], []
    for _ in range(REPEATS):
        copy = np.array(Q, order="F")
        start = time.perf_counter()
        lapack.dpotrf(copy, clean=False, overwrite_a=True)
        factor.append(time.perf_counter() - start)
        start = time.perf_counter()
        Q @ v
        product.append(time.perf_counter() - start)
    return {"cholesky_s": median(factor), "product_s": median(product)}
