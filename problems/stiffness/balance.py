"""Units in which the unknowns of a model weigh alike, and the least eigenvalue of K in them."""

from collections.abc import Callable

import numpy as np

from .arrays import Vector

POWER_STEPS = 5


def balanced_units(diagonal: Vector) -> Vector:
    """D (n,), powers of two, D_i √K_ii between 1/√2 and √2; 1 where K_ii is not positive.

    The unknowns of a finite-element model have mixed units (mm, 1, 1/mm); DKD has the digits of K.
    """
    return 1 / power_of_two(np.sqrt(np.where(diagonal > 0, diagonal, 1.0)))


def power_of_two(sizes: Vector | float) -> Vector:
    """The nearest to each size > 0: between 1/√2 and √2 of it."""
    return np.exp2(np.round(np.log2(sizes)))


def least_eigenvalue(solve: Callable[[Vector], Vector], D: Vector, steps: int = POWER_STEPS) -> float:
    """About λmin(DKD), no smaller, by the power method on its inverse. solve : b → K⁻¹b."""
    v = np.random.default_rng(0).standard_normal(len(D))
    largest = 0.0
    for _ in range(steps):
        v = v / abs(v).max()  # whose square does not overflow
        v = v / np.linalg.norm(v)
        w = solve(v / D) / D
        largest, v = float(v @ w), w
    return 1 / largest if largest > 0 else 0.0
