"""From a guess of the contact set to the solution of the dual problem, exact up to rounding."""

from dataclasses import replace

import numpy as np
import scipy.linalg as sla

from problems.forms.assembly import Mask, Matrix, Vector
from problems.forms.product import product
from solvers.base import Answer
from solvers.kkt import judged, kkt_status, rounding_of

from .block_pivoting import TrialSolution, block_pivoting

MAX_SETS = 1000


def solve_from(C: Mask, Q: Matrix, p: Vector, tolerance: float) -> Answer:
    """Block principal pivoting from C with a Cholesky factorisation of Q_CC for each set.

    A sign is wrong beyond ten times the rounding of y = Qλ − p. See `kkt.kkt_status` for "solved" and
    "inaccurate". Iterations are contact sets. Raises LinAlgError if some Q_CC is not positive definite.
    """
    found = block_pivoting(lambda C: forces_on(C, Q, p), C, np.diag(Q), 0.0, MAX_SETS)
    lam, y = np.maximum(found.trial.lam, 0.0), found.trial.y
    if (found.trial.lam < 0).any():
        y = product(Q, lam) - p
    status, residual = kkt_status(Q, p, lam, y, tolerance)
    limit = "" if found.converged else f"{MAX_SETS} contact sets"
    return judged(status, lam, residual, {"closed": int(found.C.sum())}, limit, iterations=found.passes)


def forces_on(C: Mask, Q: Matrix, p: Vector) -> TrialSolution:
    """Q_CC λ_C = p_C, refined until |y_C| no longer halves."""
    rows = np.flatnonzero(C)
    factor = sla.cho_factor(Q[np.ix_(rows, rows)], check_finite=False)
    best = TrialSolution(np.zeros(len(p)), -p, float(abs(p[rows]).max(initial=0.0)))
    while best.rounding > rounding_of(p, best.y):
        lam = best.lam.copy()
        lam[rows] -= sla.cho_solve(factor, best.y[rows], check_finite=False)
        y = product(Q, lam) - p
        before, missed = best.rounding, float(abs(y[rows]).max())
        if missed < before:
            best = TrialSolution(lam, y, missed)
        if not missed <= before / 2:
            break
    return replace(best, rounding=max(best.rounding, rounding_of(p, best.y)))
