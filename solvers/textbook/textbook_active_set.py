"""The primal–dual active set of the textbook for the dual problem min ½λᵀQλ − pᵀλ, λ ≥ 0.

M. Hintermüller, K. Ito and K. Kunisch, SIAM J. Optim. 13:865–888, 2002. From the contacts C that overlap
without forces, p > 0, it repeats

    λ_C = Q_CC⁻¹ p_C by Cholesky, λ = 0 elsewhere,    y = Qλ − p,
    leave C where λ < 0, enter C where y < 0,

until no sign is wrong. It is a semismooth Newton method: a few steps as a rule, without a proof that it ends.
"""

import numpy as np
import scipy.linalg as sla

from problems.forms.assembly import DualLoadCase
from solvers.base import Answer
from solvers.kkt import dual_answer, kkt_status
from solvers.method import Method, State

MAX_SETS = 100


class TextbookActiveSet(Method):
    """Takes no options. Starts from p > 0, or from the closed contacts of a warm start.

    Ends when no sign is wrong by more than the tolerance (λ in N, y in mm): "solved" if −y, and |y| where
    λ > 0, are at most max(tolerance, 4ε(|p| + |Q|λ)) mm, else "inaccurate"; or after a hundred sets.
    Iterations are the sets, each factored anew.
    """

    distribution = "scipy"

    def solved(self, ready: State, load: DualLoadCase, tolerance: float) -> Answer:
        Q, p = ready.Q, load.p
        closed = p > 0 if ready.start is None else ready.start.lam > 0
        lam, y, wrong, sets = np.zeros_like(p), -p, np.ones_like(closed), 0
        most = self.most(MAX_SETS)
        while wrong.any() and sets < most:
            C = np.flatnonzero(closed)
            lam = np.zeros_like(p)
            lam[C] = sla.cho_solve(sla.cho_factor(Q[np.ix_(C, C)]), p[C])
            y = Q[:, C] @ lam[C] - p
            wrong = np.where(closed, lam < -tolerance, y < -tolerance)
            closed, sets = closed ^ wrong, sets + 1
            self.log(set=sets, closed=len(C), wrong=wrong.sum())
        if (lam < 0).any():
            lam = np.maximum(lam, 0.0)
            y = Q @ lam - p
        status, residual = kkt_status(Q, p, lam, y, tolerance)
        limit = f"{most} sets" if wrong.any() else ""
        return dual_answer(status, lam, residual, {}, (sets, None), limit)
