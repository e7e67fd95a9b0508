"""Block principal pivoting: finds the contact set C with λ ≥ 0 on it and y ≥ 0 off it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Vector

from .bordered_factor import Set
from .contact_sets import TrialSolution

MAX_STALE_PASSES = 50  # passes without a new smallest count of wrong signs, before single exchanges
MAX_SINGLE_EXCHANGES = 100  # of these without one, before it gives up: there may be exponentially many
ROUNDING_FACTOR = 10.0  # times the observed rounding: a value closer to zero has no wrong sign


@dataclass(frozen=True)
class PivotingResult:
    """The contact set, its λ and y, the sets tried, and whether every sign is right."""

    C: Set
    trial: TrialSolution
    passes: int
    single_exchanges: int
    converged: bool


def wrong_signs(C: Set, trial: TrialSolution, compliance: Vector, tolerance: float) -> Set:
    """i in C with q_ii λ_i < −δ or off C with y_i < −δ, mm; δ = max(tolerance, 10 × observed rounding)."""
    floor = max(tolerance, ROUNDING_FACTOR * trial.rounding)
    return np.where(C, trial.lam * compliance, trial.y) < -floor


def block_pivoting(
    at: Callable[[Set], TrialSolution], C: Set, compliance: Vector, tolerance: float, passes: int
) -> PivotingResult:
    """Start from C and try at most `passes` sets.

    Each pass exchanges every index with a wrong sign. A pass without a new smallest count of these only opens
    contacts, as long as a force is negative, and closes contacts once none is (as Hungerländer and Rendl 2015
    reach a feasible point): this stops the oscillation that a few forces on a stiff part cause. After fifty
    such passes only the last wrong index is exchanged, until there is a new smallest count: finite for Q
    positive definite, in exact arithmetic (Júdice and Pires 1994), but exponential at worst, so that a
    hundred without one end it: `single_exchanges` then are at least as many, and it has not converged.
    """
    fewest, stale, single_exchanges = len(C) + 1, 0, 0
    for k in range(1, passes + 1):
        trial = at(C)
        wrong = wrong_signs(C, trial, compliance, tolerance)
        count = int(wrong.sum())
        if not count or k == passes or stale > MAX_STALE_PASSES + MAX_SINGLE_EXCHANGES:
            break
        fewest, stale = (count, 0) if count < fewest else (fewest, stale + 1)
        if stale > MAX_STALE_PASSES:
            single_exchanges += 1
            last = np.flatnonzero(wrong)[-1]
            wrong = np.zeros(len(C), dtype=bool)
            wrong[last] = True
        elif stale and (wrong & C).any():
            wrong &= C
        C = C ^ wrong
    return PivotingResult(C, trial, k, single_exchanges, not count)
