"""KKT residual of an approximate dual solution."""

from __future__ import annotations

import numpy as np

from problems.forms.assembly import Matrix, Vector

from .base import Status

EPS = float(np.finfo(float).eps)


def kkt_residual(lam: Vector, y: Vector) -> float:
    """max(max(−y), max_{λ>0} |y|), mm, of λ ≥ 0."""
    return max(float((-y).max(initial=0.0)), float(abs(y[lam > 0]).max(initial=0.0)))


def rounding_of(p: Vector, y: Vector) -> float:
    """About the rounding error of y = Qλ − p, mm, as 4ε max(|p| + |Qλ|)."""
    return 4 * EPS * float((abs(p) + abs(y + p)).max(initial=0.0))


def kkt_status(Q: Matrix, p: Vector, lam: Vector, y: Vector, tolerance: float) -> tuple[Status, float]:
    """Status and `kkt_residual` of λ ≥ 0 with y = Qλ − p.

    "solved" if the residual is at most max(tolerance, 4ε max(|p| + |Q|λ)), else "inaccurate".
    """
    residual = kkt_residual(lam, y)
    if residual <= tolerance:
        return "solved", residual
    rounding = 4 * EPS * float((abs(p) + abs(Q) @ lam).max(initial=0.0))
    return "solved" if residual <= rounding else "inaccurate", residual


def largest_rounding(diagonal: Vector, p: Vector, lam: Vector) -> float:
    """4ε max_i(|p_i| + √q_ii Σ_j √q_jj |λ_j|), mm: no less than 4ε max(|p| + |Q||λ|), without Q."""
    root = np.sqrt(diagonal)
    return 4 * EPS * float((abs(p) + root * (root @ abs(lam))).max(initial=0.0))
