"""What an answer to the dual problem is worth by its own optimality conditions."""

from __future__ import annotations

import numpy as np

from problems.forms.assembly import Matrix, Vector

from .base import Status

EPS = float(np.finfo(float).eps)


def checked(Q: Matrix, p: Vector, lam: Vector, y: Vector, tolerance: float) -> tuple[Status, float]:
    """The status that λ ≥ 0 with y = Qλ − p bears out, and its residual max(max(−y), max_{λ>0} |y|), mm.

    "solved" where the residual is at most max(tolerance, 4ε max(|p| + |Q|λ)), else "inaccurate".
    """
    residual = max(float((-y).max(initial=0.0)), float(abs(y[lam > 0]).max(initial=0.0)))
    if residual <= tolerance:
        return "solved", residual
    rounding = 4 * EPS * float((abs(p) + abs(Q) @ lam).max(initial=0.0))
    return "solved" if residual <= rounding else "inaccurate", residual
