"""The conjugate gradient method of Hestenes and Stiefel for a symmetric positive definite operator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Vector


@dataclass(frozen=True)
class CgResult:
    """z, the iterations spent, and whether ‖b − Hz‖ ≤ tolerance·‖b‖ was reached (recursive residual)."""

    z: Vector
    iterations: int
    converged: bool


def conjugate_gradients(
    multiply: Callable[[Vector], Vector],
    b: Vector,
    tolerance: float,
    max_iterations: int,
    precondition: Callable[[Vector], Vector] = lambda r: r,
) -> CgResult:
    """Solve Hz = b from z = 0 until ‖r‖ ≤ tolerance·‖b‖ with ‖r‖² = rᵀP⁻¹r, the 2-norm by default.

    precondition : r → P⁻¹r. Stops unconverged after max_iterations, or at a direction without positive
    curvature, which for a positive definite H means that rounding dominates.
    """
    z = np.zeros_like(b)
    r = b.copy()
    s = precondition(r)
    v = s.copy()
    rho = float(r @ s)
    target = tolerance**2 * rho
    for k in range(max_iterations):
        if rho <= target:
            return CgResult(z, k, True)
        Hv = multiply(v)
        curvature = float(v @ Hv)
        if not curvature > 0:
            return CgResult(z, k, False)
        alpha = rho / curvature
        z += alpha * v
        r -= alpha * Hv
        s = precondition(r)
        rho, before = float(r @ s), rho
        v = s + (rho / before) * v
    return CgResult(z, max_iterations, rho <= target)
