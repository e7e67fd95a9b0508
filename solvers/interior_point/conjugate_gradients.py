"""The conjugate gradient method of Hestenes and Stiefel for a symmetric positive definite operator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Vector


@dataclass(frozen=True)
class Solved:
    """The solution v, the iterations spent on it, and whether the tolerance was met."""

    v: Vector
    iterations: int
    converged: bool


def conjugate_gradients(
    multiply: Callable[[Vector], Vector],
    b: Vector,
    tolerance: float,
    max_iterations: int,
    precondition: Callable[[Vector], Vector] = lambda r: r,
) -> Solved:
    """Solve Hv = b from v = 0 until ‖r‖ ≤ tolerance·‖b‖ with ‖r‖² = rᵀP⁻¹r, the 2-norm by default.

    r = b − Hv is the recursive residual. precondition : r → P⁻¹r. Stops unconverged after max_iterations, or
    at a direction without positive curvature, which for a positive definite H means that rounding dominates.
    """
    v = np.zeros_like(b)
    r = b.copy()
    s = precondition(r)
    d = s.copy()
    rho = float(r @ s)
    target = tolerance**2 * rho
    for k in range(max_iterations):
        if rho <= target:
            return Solved(v, k, True)
        Hd = multiply(d)
        curvature = float(d @ Hd)
        if not curvature > 0:
            return Solved(v, k, False)
        alpha = rho / curvature
        v += alpha * d
        r -= alpha * Hd
        s = precondition(r)
        rho, before = float(r @ s), rho
        d = s + (rho / before) * d
    return Solved(v, max_iterations, rho <= target)
