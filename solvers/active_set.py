"""From a guess of the contact set to the answer of the dual problem, exact but for rounding."""

from __future__ import annotations

from typing import Any

import numpy as np

from .base import Answer
from .block_pivoting import block_pivoting, wrong_signs
from .bordered_factor import Set
from .contact_sets import ContactSets, product
from .kkt import checked

ENOUGH = 0.1  # of the tolerance: |y_C| that needs no refinement


def solve_from(C: Set, sets: ContactSets, tolerance: float, max_sets: int) -> Answer:
    """Block principal pivoting from C, λ_C refined against Q, and the signs looked at once more.

    Iterations are the contact sets tried. See `kkt.checked` for "solved" and "inaccurate".
    """
    passes = single = 0
    while True:
        found = block_pivoting(sets.at, C, sets.compliance, tolerance, max_sets - passes)
        passes, single = passes + found.passes, single + found.single
        trial = sets.refined(found.C, found.trial, ENOUGH * tolerance)
        wrong = wrong_signs(found.C, trial, sets.compliance, tolerance)
        if not wrong.any() or passes == max_sets:
            break
        C = found.C ^ wrong
    lam = np.maximum(trial.lam, 0.0)
    y = trial.y if (trial.lam >= 0).all() else product(sets.Q, lam) - sets.p
    status, residual = checked(sets.Q, sets.p, lam, y, tolerance)
    details: dict[str, Any] = {"closed": int(found.C.sum()), "kkt_residual_mm": residual}
    details |= {"factorisations": sets.factorisations, "single_exchanges": single}
    if status == "inaccurate":
        status = "iteration_limit" if wrong.any() else "inaccurate"
        tried = f"{passes} contact sets" if wrong.any() else "rounding"
        details["cause"] = f"{tried}: optimal to {residual:.1e} mm only"
    return Answer(status, lam, iterations=passes, details=details)
