"""Block principal pivoting: finds the contact set C with λ ≥ 0 on it and y ≥ 0 off it.

The equations of a set are solved by a function; that of `solve_from` takes Cholesky factors of Q_CC.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as sla

from problems.forms.assembly import Mask, Matrix, Vector
from problems.stiffness.dense_block import product
from solvers.base import Answer
from solvers.kkt import dual_answer, kkt_status, rounding_of

MAX_SETS = 1000  # of `solve_from`
MAX_STALE_PASSES = 2  # passes without a new smallest count of wrong signs, before steps of descent
ROUNDING_FACTOR = 10.0  # times the observed rounding: a value closer to zero has no wrong sign
SIGN_UNCERTAINTY = 1e-5  # of |y_C| where a change starts: smaller values have no reliable sign


@dataclass(frozen=True)
class TrialSolution:
    """λ (m,) N, zero off the set, y (m,) mm, and the estimated rounding error, mm, of all or of each."""

    lam: Vector
    y: Vector
    rounding: float | Vector


@dataclass(frozen=True)
class PivotingResult:
    """The contact set, its λ and y, the sets tried, the steps of descent, and whether every sign is right.

    creeps : whether it was given up, because a pass left more than 3/5 of the wrong signs.
    """

    C: Mask
    trial: TrialSolution
    passes: int
    descents: int
    converged: bool
    creeps: bool


def wrong_signs(C: Mask, trial: TrialSolution, compliance: Vector, tolerance: float | Vector) -> Mask:
    """i in C with q_ii λ_i < −δ or off C with y_i < −δ, mm; δ = max(tolerance, 10 × observed rounding)."""
    floor = np.maximum(tolerance, ROUNDING_FACTOR * trial.rounding)
    return np.where(C, trial.lam * compliance, trial.y) < -floor


def block_pivoting(
    at: Callable[[Mask], TrialSolution],
    C: Mask,
    compliance: Vector,
    tolerance: float | Vector,
    passes: int,
    patience: int | None = None,
) -> PivotingResult:
    """Pivots from C, at most `passes` sets. patience : the pass after which it is given up if it creeps.

    Each pass exchanges every index with a wrong sign. A pass without a new smallest count of these only opens
    contacts, as long as a force is negative, and closes contacts once none is (as Hungerländer and Rendl 2015
    reach a feasible point): this stops the oscillation that a few forces on a stiff part cause. After two
    such passes λ ≥ 0 moves towards the forces of each set, until the first of them is zero and opens; once
    none is negative, every wrong index closes (Lawson and Hanson 1974 close one). The objective decreases, so
    that no set comes back: for Q positive definite this ends, in exact arithmetic.
    """
    fewest, stale, descents, lam = len(C) + 1, 0, 0, np.zeros(len(C))
    count = 0
    for k in range(1, passes + 1):
        trial = at(C)
        wrong = wrong_signs(C, trial, compliance, tolerance)
        last_count, count, negative = count, int(wrong.sum()), wrong & C
        creeps = k == patience and 5 * count > 3 * last_count
        if not count or k == passes or creeps:
            break
        fewest, stale = (count, 0) if count < fewest else (fewest, stale + 1)
        if not descents and stale <= MAX_STALE_PASSES:
            C = C ^ (negative if stale and negative.any() else wrong)
            continue
        descents += 1
        if descents > 1 and negative.any():
            lam = _towards(trial.lam, lam, negative)
            C = C & ~(negative & (lam == 0))
        else:
            lam, C = np.maximum(trial.lam, 0.0), C ^ wrong
    return PivotingResult(C, trial, k, descents, not count, creeps)


def _towards(aim: Vector, lam: Vector, negative: Mask) -> Vector:
    """From λ ≥ 0 towards `aim` until the first of its negative entries is zero, exactly."""
    share = np.full(len(lam), np.inf)
    share[negative] = lam[negative] / (lam - aim)[negative]
    new: Vector = np.maximum(lam + share.min() * (aim - lam), 0.0)
    new[share == share.min()] = 0.0
    return new


def solve_from(C: Mask, Q: Matrix, p: Vector, tolerance: float) -> Answer:
    """Block principal pivoting from C with a Cholesky factorisation of Q_CC for each set.

    A sign is wrong beyond ten times the rounding of y = Qλ − p. See `kkt.kkt_status` for "solved" and
    "inaccurate". Iterations are contact sets. Raises LinAlgError if some Q_CC is not positive definite.
    """
    result = block_pivoting(lambda C: forces_on(C, Q, p), C, np.diag(Q), 0.0, MAX_SETS)
    lam, y = np.maximum(result.trial.lam, 0.0), result.trial.y
    if (result.trial.lam < 0).any():
        y = product(Q, lam) - p
    status, residual = kkt_status(Q, p, lam, y, tolerance)
    details, limit = {"closed": int(result.C.sum())}, "" if result.converged else f"{MAX_SETS} contact sets"
    return dual_answer(status, lam, residual, details, (result.passes, None), limit)


def forces_on(C: Mask, Q: Matrix, p: Vector) -> TrialSolution:
    """Q_CC λ_C = p_C, refined until |y_C| no longer halves."""
    rows = np.flatnonzero(C)
    factor = sla.cho_factor(Q[np.ix_(rows, rows)], check_finite=False)
    best, previous = TrialSolution(np.zeros(len(p)), -p, 0.0), float(abs(p[rows]).max(initial=0.0))
    while (abs(best.y) > rounding_of(p, best.y))[rows].any():
        lam = best.lam.copy()
        lam[rows] -= sla.cho_solve(factor, best.y[rows], check_finite=False)
        y = product(Q, lam) - p
        missed = float(abs(y[rows]).max())
        if missed < previous:
            best = TrialSolution(lam, y, missed)
        if not missed <= previous / 2:
            break
        previous = missed
    return replace(best, rounding=np.maximum(abs(best.y[rows]).max(initial=0.0), rounding_of(p, best.y)))
