"""Block principal pivoting for the dual problem: finds the contact set for the reference.

    λ ≥ 0,   y = Qλ − p ≥ 0,   λᵀy = 0

Source: Júdice and Pires, Comput. Oper. Res. 21:587–596, 1994. Finite for symmetric positive definite Q.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from problems.forms.assembly import Vector
from problems.forms.compliance import AnyQ, dense_submatrix, submatrix

ROUNDING = 10  # times the rounding that is seen
FEW = 100  # contacts
FULL_EXCHANGES = 3  # without a new smallest count of infeasibilities, before single pivots begin


def contact_set(Q: AnyQ, p: Vector, start: NDArray[np.bool_] | None = None) -> NDArray[np.bool_]:
    """The closed contacts: (m,) bool, with λ > 0 and y = 0 where True.

    Each pass solves Q_SS λ_S = p_S and exchanges every i in S with λ_i < 0 and outside it with
    y_i < 0. After three passes without a new smallest count of such i, only the last of them is
    exchanged until there is one: in exact arithmetic this cannot cycle. Values within rounding of zero
    are taken as zero: rounding is what the equations leave over in y_S, and what that moves λ_S.
    Should rounding still lead in circles, the first set met again is returned for others to check.

    start : the first S, by default from half of the contacts.
    """
    return _pivoted(Q, p, _first_set(Q, p) if start is None else start)[0]


def _first_set(Q: AnyQ, p: Vector) -> NDArray[np.bool_]:
    """What is closed where only every other contact is kept, and what then overlaps; of few contacts p > 0.

    The forces of the half come from its own half: small factors replace most of those of many rows.
    """
    if len(p) <= FEW or not (p > 0).any():
        return p > 0
    half = submatrix(Q, np.arange(0, len(p), 2)), p[::2]
    lam = np.zeros(len(p))
    lam[::2] = _pivoted(*half, _first_set(*half))[1]
    return (lam > 0) | (Q @ lam < p)


def _pivoted(Q: AnyQ, p: Vector, S: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], Vector]:
    """The closed contacts and λ, from a first set S."""
    m = len(p)
    fewest, chances = m + 1, FULL_EXCHANGES
    met: set[bytes] = set()
    while True:
        lam, y, lam_rounding, y_rounding = _solve_on(Q, p, S)
        wrong = np.where(S, lam < -ROUNDING * lam_rounding, y < -ROUNDING * y_rounding)
        count = int(wrong.sum())
        if count == 0:
            return S, lam
        if count < fewest:
            fewest, chances = count, FULL_EXCHANGES
            met.clear()
        elif chances:
            chances -= 1
        elif S.tobytes() in met:
            return S, lam
        else:
            met.add(S.tobytes())
            last = np.flatnonzero(wrong)[-1]
            wrong = np.zeros(m, dtype=bool)
            wrong[last] = True
        S = S ^ wrong


def _solve_on(Q: AnyQ, p: Vector, S: NDArray[np.bool_]) -> tuple[Vector, Vector, float, float]:
    """λ with Q_SS λ_S = p_S and λ = 0 outside S, y = Qλ − p outside S, and the rounding of either."""
    lam = np.zeros(len(p))
    rows = np.flatnonzero(S)
    if not rows.size:
        return lam, -p, 0.0, 0.0
    block = dense_submatrix(Q, rows)
    factor = sla.cho_factor(block, lower=True, overwrite_a=True, check_finite=False)
    lam[rows] = sla.cho_solve(factor, p[rows], check_finite=False)
    y = Q @ lam - p
    left_over = y[rows]
    y[rows] = 0.0
    correction = sla.cho_solve(factor, left_over, check_finite=False)
    y_rounding = max(abs(left_over).max(initial=0), np.finfo(float).eps * abs(p).max())
    return lam, y, float(abs(correction).max(initial=0)), float(y_rounding)
