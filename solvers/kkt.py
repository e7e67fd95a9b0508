"""The KKT residual of an approximate dual solution, and the status of the answer that follows from it.

In the sparse form x decides the status (`with_x`).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from problems.forms.assembly import Matrix, Vector, stacked

from .base import Answer, LoadCase, Problem, Status

EPS = float(np.finfo(float).eps)
ROUNDING_MM = 1e-7  # the largest δ that is taken for rounding


def kkt_residual(lam: Vector, y: Vector) -> float:
    """max(max(−y), max_{λ>0} |y|), mm, of λ ≥ 0."""
    return max(float((-y).max(initial=0.0)), float(abs(y[lam > 0]).max(initial=0.0)))


def rounding_of(p: Vector, y: Vector) -> float:
    """An estimate of the rounding error of y = Qλ − p, mm: 4ε max(|p| + |Qλ|)."""
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


def dual_answer(
    status: Status,
    lam: Vector,
    residual: float,
    details: dict[str, Any],
    iterations: tuple[int, int | None],
    limit: str = "",
    cause: str = "rounding",
) -> Answer:
    """The answer of a method on the dual form, with its KKT residual, and the cause if it is not solved.

    iterations : outer and inner ones. limit : the limit that stopped the method, if any; "inaccurate" then
    becomes "iteration_limit".
    """
    details = details | {"kkt_residual_mm": residual}
    if status != "solved":
        status = "iteration_limit" if limit else "inaccurate"
        details["cause"] = f"{limit or cause}: optimal only to {residual:.1e} mm"
    return Answer(status, lam, None, *iterations, details=details)


def largest_rounding(diagonal: Vector, p: Vector, lam: Vector) -> float:
    """4ε max_i(|p_i| + √q_ii Σ_j √q_jj |λ_j|), mm: a bound of 4ε max(|p| + |Q||λ|) that needs no Q."""
    root = np.sqrt(diagonal)
    return 4 * EPS * float((abs(p) + root * (root @ abs(lam))).max(initial=0.0))


def with_x(
    problem: Problem, answers: Sequence[Answer], loads: Sequence[LoadCase], tolerance: float
) -> list[Answer]:
    """The answers, in the sparse form with x = K⁻¹(f − Aλ) refined by δ, and the status of this x.

    "solved" if the KKT residual of y = g − Aᵀx is at most max(tolerance, min(ρ, ROUNDING_MM)), ρ the part due
    to rounding: of g and x, of x as δ shows it, and of the forces, by e = ε|K⁻¹(|f| + |A|λ)|,

        ρ = 4 max(ε|g| + ε|A|ᵀ|x| + |A|ᵀ|δ|) + 4 max(|A|ᵀe).
    """
    with_lam = [k for k, answer in enumerate(answers) if answer.lam is not None]
    refined = list(answers)
    if problem.bounded or not with_lam:
        return refined
    assembly, cases = problem.assembly, stacked([loads[k] for k in with_lam])
    lam = np.column_stack([np.asarray(answers[k].lam) for k in with_lam])
    b = cases.f - assembly.A @ lam
    x = assembly.K.solve(b)
    delta = assembly.K.solve(b - assembly.K.multiply(x))
    x = x + delta
    y, size = cases.g - assembly.A.T @ x, abs(assembly.A).T
    rounding = 4 * (EPS * (abs(cases.g) + size @ abs(x)) + size @ abs(delta)).max(axis=0)
    missed = np.where(lam > 0, abs(y), -y).max(axis=0, initial=0.0)
    if (missed > np.maximum(tolerance, rounding)).any():
        moved = assembly.K.solve(abs(cases.f) + abs(assembly.A) @ abs(lam))
        rounding = rounding + 4 * EPS * (size @ abs(moved)).max(axis=0)
    for column, k in enumerate(with_lam):
        status, residual = refined[k].status, float(missed[column])
        if status in ("solved", "inaccurate"):
            allowed = max(tolerance, min(rounding[column], ROUNDING_MM))
            status = "solved" if residual <= allowed else "inaccurate"
        details = refined[k].details | {"kkt_residual_mm": residual}
        if status == "solved":
            details.pop("cause", None)
        elif "cause" not in details:
            details["cause"] = f"rounding: optimal only to {residual:.1e} mm"
        refined[k] = replace(refined[k], status=status, x=x[:, column], details=details)
    return refined
