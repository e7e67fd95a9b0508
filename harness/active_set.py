"""Block principal pivoting for the dual problem: finds the contact set for the reference.

    λ ≥ 0,   y = Qλ − p ≥ 0,   λᵀy = 0

Source: Júdice and Pires, Comput. Oper. Res. 21:587–596, 1994. Finite for symmetric positive definite Q.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from problems.assembly import Matrix, Vector

FULL_EXCHANGES = 3  # without a new smallest count of infeasibilities, before single pivots begin


def contact_set(Q: Matrix, p: Vector, start: NDArray[np.bool_] | None = None) -> NDArray[np.bool_]:
    """The closed contacts: (m,) bool, with λ > 0 and y = 0 where True.

    Each pass solves Q_SS λ_S = p_S and exchanges every i in S with λ_i < 0 and outside it with
    y_i < 0. After three passes without a new smallest count of such i, only the last of them is
    exchanged until there is one: this cannot cycle. Values within rounding of zero, that is
    |λ_i| ≤ 4ε max|λ| and |y_i| ≤ 4ε (|p_i| + max|p|), are taken as zero.
    """
    m = len(p)
    S = p > 0 if start is None else start.copy()
    fewest, chances = m + 1, FULL_EXCHANGES
    eps = 4 * np.finfo(float).eps
    while True:
        lam, y = solve_on(Q, p, S)
        wrong = np.where(S, lam < -eps * abs(lam).max(initial=0), y < -eps * (abs(p) + abs(p).max()))
        count = int(wrong.sum())
        if count == 0:
            return S
        if count < fewest:
            fewest, chances = count, FULL_EXCHANGES
        elif chances:
            chances -= 1
        else:
            last = np.flatnonzero(wrong)[-1]
            wrong = np.zeros(m, dtype=bool)
            wrong[last] = True
        S = S ^ wrong


def solve_on(Q: Matrix, p: Vector, S: NDArray[np.bool_]) -> tuple[Vector, Vector]:
    """λ with Q_SS λ_S = p_S and λ = 0 outside S, and y = Qλ − p with y_S = 0."""
    lam = np.zeros(len(p))
    rows = np.flatnonzero(S)
    if rows.size:
        factor = sla.cho_factor(Q[np.ix_(rows, rows)], overwrite_a=True, check_finite=False)
        lam[rows] = sla.cho_solve(factor, p[rows], check_finite=False)
    y = Q @ lam - p
    y[rows] = 0.0
    return lam, y
