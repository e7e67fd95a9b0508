"""Block principal pivoting for the dual problem: finds the contact set for the reference.

    λ ≥ 0,   y = Qλ − p ≥ 0,   λᵀy = 0

Source: Júdice and Pires, Comput. Oper. Res. 21:587–596, 1994. Finite for symmetric positive definite Q.

The solvers have a block-pivoting code of their own (solvers/active_set/block_pivoting.py), on purpose: the
referee shares no code with the solvers it judges.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from problems.forms.assembly import Matrix, Vector

from .interior_point import interior_contact_set

Stop = Callable[[], bool]
#: A set S → λ, y = Qλ − p = g − Aᵀx outside S, and the rounding of both.
Solution = Callable[[NDArray[np.bool_]], tuple[Vector, Vector, float, float]]
Rescue = Callable[[], NDArray[np.bool_] | None]

ROUNDING = 10  # times the observed rounding
SMALL_PROBLEM = 100  # contacts, up to which the first set is p > 0
SINGLE_EXCHANGES = 20  # without one, before the interior point takes over
FULL_EXCHANGES = 3  # without a new smallest count of infeasibilities, before single pivots begin


def contact_set(
    Q: Matrix, p: Vector, start: NDArray[np.bool_] | None = None, stop: Stop = lambda: False
) -> NDArray[np.bool_]:
    """The closed contacts: (m,) bool, with λ > 0 and y = 0 where True; a guess, if `stop` ends the search.

    Each pass solves Q_SS λ_S = p_S and exchanges every i in S with λ_i < 0 and outside S with y_i < 0. After
    three passes without a new smallest count of such i, only the last of them is exchanged until there is
    one: in exact arithmetic this cannot cycle, but it can take exponentially many passes. So after twenty
    the interior point takes over, once, and pivoting goes on from its set; what then still makes no progress
    is returned as it is, for the caller to check, and so is a set visited twice because of rounding. A new
    smallest count is found at most m times: at most m(20 + 3) passes in all, polynomially many. Values within
    rounding of zero count as zero; rounding is estimated by the residual of the equations in y_S, and by the
    change in λ_S that it causes.

    start : the first S, by default from half of the contacts. stop : asked before each factorisation.
    """
    return _pivoted(Q, p, _first_set(Q, p, stop) if start is None else start, stop)[0]


def pivoted(
    at: Solution, S: NDArray[np.bool_], rescue: Rescue, stop: Stop
) -> tuple[NDArray[np.bool_], Vector]:
    """The closed contacts and λ, by the passes above, from a first set S.

    rescue : a set from another method, asked for once; None if it has none.
    """
    m = len(S)
    fewest, full_exchanges = m + 1, FULL_EXCHANGES
    visited: set[bytes] = set()
    rescued = False
    while True:
        lam, y, lam_rounding, y_rounding = at(S)
        wrong = np.where(S, lam < -ROUNDING * lam_rounding, y < -ROUNDING * y_rounding)
        count = int(wrong.sum())
        if count == 0 or stop():
            return S, lam
        if count < fewest:
            fewest, full_exchanges = count, FULL_EXCHANGES
            visited.clear()
        elif full_exchanges:
            full_exchanges -= 1
        elif S.tobytes() in visited or len(visited) == SINGLE_EXCHANGES:
            another = None if rescued else rescue()
            if another is None:
                return S, lam
            S, rescued = another, True
            fewest, full_exchanges = m + 1, FULL_EXCHANGES
            visited.clear()
            continue
        else:
            visited.add(S.tobytes())
            last = np.flatnonzero(wrong)[-1]
            wrong = np.zeros(m, dtype=bool)
            wrong[last] = True
        S = S ^ wrong


def _first_set(Q: Matrix, p: Vector, stop: Stop) -> NDArray[np.bool_]:
    """The contacts closed if every other one is left out, and those that then overlap; p > 0 if m is small.

    The half is solved in the same way, from its own half: small factors replace most of the large ones.
    """
    if len(p) <= SMALL_PROBLEM or not (p > 0).any():
        return p > 0
    half = np.ascontiguousarray(Q[::2, ::2]), p[::2]
    lam = np.zeros(len(p))
    lam[::2] = _pivoted(*half, _first_set(*half, stop), stop)[1]
    return (lam > 0) | (Q @ lam < p)


def _pivoted(Q: Matrix, p: Vector, S: NDArray[np.bool_], stop: Stop) -> tuple[NDArray[np.bool_], Vector]:
    """The closed contacts and λ, from a first set S."""
    return pivoted(lambda C: _solve_for(Q, p, C), S, lambda: interior_contact_set(Q, p, stop), stop)


def _solve_for(Q: Matrix, p: Vector, S: NDArray[np.bool_]) -> tuple[Vector, Vector, float, float]:
    """λ with Q_SS λ_S = p_S and λ = 0 outside S, y = Qλ − p outside S, and the rounding of both."""
    lam = np.zeros(len(p))
    rows = np.flatnonzero(S)
    if not rows.size:
        return lam, -p, 0.0, 0.0
    block = Q[np.ix_(rows, rows)].T
    factor = sla.cho_factor(block, lower=True, overwrite_a=True, check_finite=False)
    lam[rows] = sla.cho_solve(factor, p[rows], check_finite=False)
    y = Q @ lam - p
    residual = y[rows]
    y[rows] = 0.0
    correction = sla.cho_solve(factor, residual, check_finite=False)
    y_rounding = max(abs(residual).max(initial=0), np.finfo(float).eps * abs(p).max())
    return lam, y, float(abs(correction).max(initial=0)), float(y_rounding)
