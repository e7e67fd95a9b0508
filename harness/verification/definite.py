"""A proven lower bound on the smallest eigenvalue of K, in given units, whatever its factor.

A Cholesky factorisation of B = fl(DKD − sI) that runs to completion has an exact B + E with a known bound on
‖E‖₂ (see `Block.shifted`), so that λmin(DKD) ≥ s − ‖E‖₂.

An eigenvalue below 2⁻¹⁰⁰⁰ counts as none: above, what underflows in the factorisation, some n²η with
η = 2⁻¹⁰⁷⁴, is within the margin's last 1 %.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from problems.forms.assembly import Vector
from problems.stiffness.operator import Stiffness

SHARES = (1.0, 0.2, 0.02)  # of the guess, tried in turn
SAFE = 1.01  # for the rounding of the bound itself
SMALLEST = 2.0**-1000


def smallest_eigenvalue(K: Stiffness, D: Vector, guesses: Sequence[float]) -> float:
    """κ ≤ λmin(DKD), proven; 0 if no positive one was found.

    D (n,) : powers of two. guesses : of a κ for each block; the closer from below, the sharper the bound.
    """
    least = np.inf
    for block, rows, guess in zip(K.blocks, K.slices, guesses, strict=True):
        for s in (share * guess for share in SHARES):
            error = block.shifted(D[rows], s)
            if error is not None and s - SAFE * error >= SMALLEST:
                least = min(least, s - SAFE * error)
                break
        else:
            return 0.0
    return float(least)
