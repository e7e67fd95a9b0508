"""Block principal pivoting: finds the set C with λ ≥ 0 on it and y ≥ 0 off it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Vector

from .bordered_factor import Set
from .contact_sets import Trial

FORCES_FIRST = 50  # passes without a new smallest count of wrong signs, before single exchanges begin
ROUNDING = 10.0  # a sign within so many times the rounding that is seen is not wrong


@dataclass(frozen=True)
class Outcome:
    """The set, what was found on it, the sets tried, and whether no sign is wrong."""

    C: Set
    trial: Trial
    passes: int
    single: int
    done: bool


def wrong_signs(C: Set, trial: Trial, compliance: Vector, tolerance: float) -> Set:
    """i in C with q_ii λ_i < −δ or off it with y_i < −δ, δ = max(tolerance, 10 × the rounding seen), mm."""
    floor = max(tolerance, ROUNDING * trial.rounding)
    return np.where(C, trial.lam * compliance, trial.y) < -floor


def block_pivoting(
    at: Callable[[Set], Trial], C: Set, compliance: Vector, tolerance: float, passes: int
) -> Outcome:
    """From C on, at most `passes` sets.

    Each pass exchanges every wrong index. Until there is a new smallest count of them, as long as a force
    is negative only such contacts open, and others close once none is (as Hungerländer and Rendl 2015
    reach a feasible point); that ends the swings that a few forces on a stiff part cause. After fifty such
    passes only the last wrong index is exchanged, until there is a new smallest count: finite for Q
    positive definite, in exact arithmetic (Júdice and Pires 1994).
    """
    fewest, stale, single = len(C) + 1, 0, 0
    for k in range(1, passes + 1):
        trial = at(C)
        wrong = wrong_signs(C, trial, compliance, tolerance)
        count = int(wrong.sum())
        if not count or k == passes:
            break
        fewest, stale = (count, 0) if count < fewest else (fewest, stale + 1)
        if stale > FORCES_FIRST:
            single += 1
            last = np.flatnonzero(wrong)[-1]
            wrong = np.zeros(len(C), dtype=bool)
            wrong[last] = True
        elif stale and (wrong & C).any():
            wrong &= C
        C = C ^ wrong
    return Outcome(C, trial, k, single, not count)
