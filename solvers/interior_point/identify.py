"""The contact set by an interior point, for methods whose contact sets make no progress."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from problems.forms.assembly import Matrix, Vector

from .newton_system import Direct
from .schemes import NewtonSteps, mehrotra
from .start import stp2

ITERATIONS = 60
SMALLEST_MU = 1e-20  # of the first μ: signs do not change any more
THETA, RHO, LEAST_GAP = 0.995, 10.0, 0.01  # step to the boundary; STP2, mm


def identified_set(Q: Matrix, p: Vector) -> NDArray[np.bool_]:
    """(m,) bool, q_ii λ_i > y_i after Mehrotra's iterations: about 20 Cholesky factorisations, at most 60.

    Raises LinAlgError where Q is not positive definite.
    """
    newton = NewtonSteps(Q, p, Direct(Q), THETA, 0.0, 1.0, np.inf)
    start = stp2(Q, p, RHO, LEAST_GAP)
    point = newton.at(start.lam, start.y)
    smallest = SMALLEST_MU * point.mu
    for _ in range(ITERATIONS):
        following = mehrotra(newton, point)
        if not np.isfinite(following.mu):
            break
        point = following
        if point.mu <= smallest:
            break
    return np.diag(Q) * point.lam > point.y
