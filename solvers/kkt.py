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


def kkt_errors(lam: Vector, y: Vector) -> Vector:
    """|y| where λ > 0, and max(−y, 0) elsewhere, mm, of λ ≥ 0."""
    errors: Vector = np.where(lam > 0, abs(y), np.maximum(-y, 0.0))
    return errors


def kkt_residual(lam: Vector, y: Vector) -> float:
    """max(max(−y), max_{λ>0} |y|), mm, of λ ≥ 0."""
    return float(kkt_errors(lam, y).max(initial=0.0))


def is_small(errors: Vector, tolerance: float, rounding: Vector) -> bool:
    """Whether the error of each contact is at most the tolerance or its own rounding, mm.

    A contact far from all others rounds by more than their gaps, and says nothing of theirs.
    """
    return bool((errors <= np.maximum(tolerance, rounding)).all())


def rounding_of(p: Vector, y: Vector) -> Vector:
    """An estimate of the rounding error of y = Qλ − p, mm: 4ε(|p| + |Qλ|)."""
    return 4 * EPS * (abs(p) + abs(y + p))


def rounding_bound(diagonal: Vector, p: Vector, lam: Vector) -> Vector:
    """4ε(|p_i| + √q_ii Σ_j √q_jj |λ_j|), mm: a bound of 4ε(|p| + |Q||λ|) that needs no Q."""
    root = np.sqrt(diagonal)
    return 4 * EPS * (abs(p) + root * (root @ abs(lam)))


def kkt_status(Q: Matrix, p: Vector, lam: Vector, y: Vector, tolerance: float) -> tuple[Status, float]:
    """Status and `kkt_residual` of λ ≥ 0 with y = Qλ − p.

    "solved" if `kkt_errors` are at most max(tolerance, 4ε(|p| + |Q|λ)), else "inaccurate".
    """
    residual = kkt_residual(lam, y)
    if residual <= tolerance:
        return "solved", residual
    solved = is_small(kkt_errors(lam, y), tolerance, 4 * EPS * (abs(p) + abs(Q) @ lam))
    return "solved" if solved else "inaccurate", residual


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


def with_x(
    problem: Problem, answers: Sequence[Answer], loads: Sequence[LoadCase], tolerance: float
) -> list[Answer]:
    """The answers, in the sparse form with x = K⁻¹(f − Aλ) refined by δ, and the status of this x.

    "solved" if the KKT errors of y = g − Aᵀx are at most max(tolerance, min(ρ, 1e-7 mm)), ρ the part due
    to rounding: of g and x, of x as δ shows it, and of the forces, by e = ε|K⁻¹(|f| + |A|λ)|,

        ρ = 4ε|g| + 4 max(ε|A|ᵀ|x| + |A|ᵀ|δ|) + 4 max(|A|ᵀe).
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
    rounding = 4 * EPS * abs(cases.g) + 4 * (EPS * (size @ abs(x)) + size @ abs(delta)).max(axis=0)
    errors = kkt_errors(lam, y)
    if not is_small(errors, tolerance, rounding):
        moved = assembly.K.solve(abs(cases.f) + abs(assembly.A) @ abs(lam))
        rounding = rounding + 4 * EPS * (size @ abs(moved)).max(axis=0)
    rounding = np.minimum(rounding, ROUNDING_MM / np.array([loads[k].length for k in with_lam]))
    for column, k in enumerate(with_lam):
        status, residual = refined[k].status, float(errors[:, column].max(initial=0.0))
        if status in ("solved", "inaccurate"):
            solved = is_small(errors[:, column], tolerance, rounding[:, column])
            status = "solved" if solved else "inaccurate"
        details = refined[k].details | {"kkt_residual_mm": residual}
        if status == "solved":
            details.pop("cause", None)
        elif "cause" not in details:
            details["cause"] = f"rounding: optimal only to {residual:.1e} mm"
        refined[k] = replace(refined[k], status=status, x=x[:, column], details=details)
    return refined
