"""The KKT residual of an approximate dual solution, and the answer that it makes."""

from typing import Any

import numpy as np

from problems.forms.assembly import Matrix, Vector

from .base import Answer, Status

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


def judged(
    status: Status,
    lam: Vector,
    residual: float,
    details: dict[str, Any],
    limit: str = "",
    cause: str = "rounding",
    *,
    iterations: int,
    inner_iterations: int | None = None,
) -> Answer:
    """The answer λ with its KKT residual in the details, and with the cause if it is not solved.

    limit : the one that stopped the method, if one did: "inaccurate" then becomes "iteration_limit".
    """
    details = details | {"kkt_residual_mm": residual}
    if status != "solved":
        status = "iteration_limit" if limit else "inaccurate"
        details["cause"] = f"{limit or cause}: optimal only to {residual:.1e} mm"
    return Answer(status, lam, None, iterations, inner_iterations, details=details)


def largest_rounding(diagonal: Vector, p: Vector, lam: Vector) -> float:
    """4ε max_i(|p_i| + √q_ii Σ_j √q_jj |λ_j|), mm: no less than 4ε max(|p| + |Q||λ|), without Q."""
    root = np.sqrt(diagonal)
    return 4 * EPS * float((abs(p) + root * (root @ abs(lam))).max(initial=0.0))
