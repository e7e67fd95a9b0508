"""From a guess of the contact set to the solution of the dual problem, exact up to rounding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.forms.product import product
from solvers.base import Answer
from solvers.kkt import kkt_residual, kkt_status, rounding_of

from .block_pivoting import MAX_SINGLE_EXCHANGES, block_pivoting, wrong_signs
from .bordered_factor import Set
from .contact_sets import ContactSets, TrialSolution

RESIDUAL_TARGET = 0.1  # of the tolerance: |y_C| that needs no further refinement
MAX_FINER_SETS = 30  # tried for signs that are wrong by less than the tolerance


#: (Q, p) → a contact set.
Identified = Callable[[Matrix, Vector], Set]


class Sets(Protocol):
    """λ and y of one contact set after another. compliance : the diagonal of Q."""

    p: Vector
    compliance: Vector

    @property
    def Q(self) -> Matrix: ...

    @property
    def factorisations(self) -> int: ...

    def at(self, C: Set) -> TrialSolution: ...

    def refined(self, C: Set, trial: TrialSolution, target: float) -> TrialSolution: ...


@dataclass(frozen=True)
class _Settled:
    C: Set
    trial: TrialSolution
    passes: int
    single_exchanges: int
    converged: bool


def solve_from(C: Set, sets: Sets, tolerance: float, max_sets: int) -> Answer:
    """Block principal pivoting from C, with λ_C refined against Q and the signs checked again.

    Once no sign is wrong by more than the tolerance, up to 30 further sets correct those beyond rounding:
    with nearly dependent constraints, a sign within the tolerance can hide a wrong set. Where rounding lets
    these sets alternate, the one with the smaller KKT residual is taken. Iterations are the contact sets
    tried. See `kkt.kkt_status` for "solved" and "inaccurate".
    """
    best = _settled(C, sets, tolerance, tolerance, max_sets)
    passes, single_exchanges = best.passes, best.single_exchanges
    floor = rounding_of(sets.p, best.trial.y)
    wrong = wrong_signs(best.C, best.trial, sets.compliance, floor)
    if best.converged and wrong.any():
        finer = _settled(best.C ^ wrong, sets, floor, tolerance, MAX_FINER_SETS)
        passes, single_exchanges = passes + finer.passes, single_exchanges + finer.single_exchanges
        if finer.converged or kkt_residual(*_point(sets, finer)) < kkt_residual(*_point(sets, best)):
            best = replace(finer, converged=True)
    lam, y = _point(sets, best)
    status, residual = kkt_status(sets.Q, sets.p, lam, y, tolerance)
    details: dict[str, Any] = {"closed": int(best.C.sum()), "kkt_residual_mm": residual}
    details |= {"factorisations": sets.factorisations, "single_exchanges": single_exchanges}
    if status == "inaccurate":
        status = "inaccurate" if best.converged else "iteration_limit"
        tried = "rounding" if best.converged else f"{passes} contact sets"
        details["cause"] = f"{tried}: optimal only to {residual:.1e} mm"
    return Answer(status, lam, iterations=passes, details=details)


def solve_or_identify(
    C: Set, sets: ContactSets, tolerance: float, max_sets: int, identified: Identified
) -> Answer:
    """`solve_from` C; if its sets made no progress, from the set that is identified otherwise."""
    answer = solve_from(C, sets, tolerance, max_sets)
    if answer.status == "solved" or answer.details["single_exchanges"] < MAX_SINGLE_EXCHANGES:
        return answer
    again = solve_from(identified(sets.Q, sets.p), sets, tolerance, max_sets)
    if again.details["kkt_residual_mm"] > answer.details["kkt_residual_mm"]:
        return answer
    tried = (answer.iterations or 0) + (again.iterations or 0)
    return replace(again, iterations=tried, details=again.details | {"interior_point": True})


def _point(sets: Sets, found: _Settled) -> tuple[Vector, Vector]:
    """λ without its negative entries, and y = Qλ − p of that."""
    lam = np.maximum(found.trial.lam, 0.0)
    return lam, found.trial.y if (found.trial.lam >= 0).all() else product(sets.Q, lam) - sets.p


def _settled(C: Set, sets: Sets, threshold: float, tolerance: float, max_sets: int) -> _Settled:
    """Pivot until no sign is wrong by more than `threshold`, mm, with λ_C refined for the tolerance."""
    passes = single_exchanges = 0
    while True:
        found = block_pivoting(sets.at, C, sets.compliance, threshold, max_sets - passes)
        passes, single_exchanges = passes + found.passes, single_exchanges + found.single_exchanges
        trial = sets.refined(found.C, found.trial, RESIDUAL_TARGET * tolerance)
        wrong = wrong_signs(found.C, trial, sets.compliance, threshold)
        if not wrong.any() or passes == max_sets or not found.converged:
            return _Settled(found.C, trial, passes, single_exchanges, not wrong.any())
        C = found.C ^ wrong
