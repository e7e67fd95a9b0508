"""KKT residual of an approximate dual solution."""

from __future__ import annotations

import numpy as np

from problems.forms.assembly import Vector
from problems.forms.compliance import AnyQ, Compliance

from .base import Status

EPS = float(np.finfo(float).eps)


def kkt_residual(lam: Vector, y: Vector) -> float:
    """max(max(−y), max_{λ>0} |y|), mm, of λ ≥ 0."""
    return max(float((-y).max(initial=0.0)), float(abs(y[lam > 0]).max(initial=0.0)))


def rounding_of(p: Vector, y: Vector) -> float:
    """About the rounding error of y = Qλ − p, mm, as 4ε max(|p| + |Qλ|)."""
    return 4 * EPS * float((abs(p) + abs(y + p)).max(initial=0.0))


def kkt_status(Q: AnyQ, p: Vector, lam: Vector, y: Vector, tolerance: float) -> tuple[Status, float]:
    """Status and `kkt_residual` of λ ≥ 0 with y = Qλ − p.

    "solved" if the residual is at most max(tolerance, 4ε max(|p| + |Q|λ)), else "inaccurate". |Qλ| replaces
    |Q|λ if Q is given by its products.
    """
    residual = kkt_residual(lam, y)
    if residual <= tolerance:
        return "solved", residual
    size = abs(y + p) if isinstance(Q, Compliance) else abs(Q) @ lam
    rounding = 4 * EPS * float((abs(p) + size).max(initial=0.0))
    return "solved" if residual <= rounding else "inaccurate", residual


def rounding(diagonal: Vector, p: Vector, lam: Vector) -> float:
    """Bound on the rounding error of y = Qλ − p, mm, but for its growth with m: 4ε max_i(|p_i| + √q_ii Σ_j √q_jj λ_j),
    as |q_ij| ≤ √(q_ii q_jj).
    """
    root = np.sqrt(diagonal)
    return 4 * EPS * float((abs(p) + root * (root @ abs(lam))).max(initial=0.0))
