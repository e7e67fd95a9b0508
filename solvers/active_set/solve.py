"""From a guess of the contact set to the answer of the dual problem, exact but for rounding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.base import Answer
from solvers.kkt import checked
from solvers.linear_algebra.product import product

from .block_pivoting import block_pivoting, wrong_signs
from .bordered_factor import Set
from .contact_sets import ContactSets, Trial

ENOUGH = 0.1  # of the tolerance: |y_C| that needs no refinement
FINER_SETS = 30  # tried at most for signs that are wrong by less than the tolerance


@dataclass(frozen=True)
class _Settled:
    C: Set
    trial: Trial
    passes: int
    single: int
    done: bool


def solve_from(C: Set, sets: ContactSets, tolerance: float, max_sets: int) -> Answer:
    """Block principal pivoting from C, λ_C refined against Q, and the signs looked at once more.

    Once no sign is wrong by more than the tolerance it goes on to those that rounding does not explain,
    if that ends soon: beside contacts that say nearly the same, a sign within the tolerance can hide a
    wrong set. Iterations are the contact sets tried. See `kkt.checked` for "solved" and "inaccurate".
    """
    best = _settled(C, sets, tolerance, tolerance, max_sets)
    passes, single = best.passes, best.single
    wrong = wrong_signs(best.C, best.trial, sets.compliance, 0.0)
    if best.done and wrong.any():
        finer = _settled(best.C ^ wrong, sets, 0.0, tolerance, FINER_SETS)
        passes, single = passes + finer.passes, single + finer.single
        best = finer if finer.done else best
    lam = np.maximum(best.trial.lam, 0.0)
    y = best.trial.y if (best.trial.lam >= 0).all() else product(sets.Q, lam) - sets.p
    status, residual = checked(sets.Q, sets.p, lam, y, tolerance)
    details: dict[str, Any] = {"closed": int(best.C.sum()), "kkt_residual_mm": residual}
    details |= {"factorisations": sets.factorisations, "single_exchanges": single}
    if status == "inaccurate":
        status = "inaccurate" if best.done else "iteration_limit"
        tried = "rounding" if best.done else f"{passes} contact sets"
        details["cause"] = f"{tried}: optimal to {residual:.1e} mm only"
    return Answer(status, lam, iterations=passes, details=details)


def _settled(C: Set, sets: ContactSets, asked: float, tolerance: float, max_sets: int) -> _Settled:
    """From C until no sign is wrong by more than `asked`, in mm, with λ_C refined for the tolerance."""
    passes = single = 0
    while True:
        found = block_pivoting(sets.at, C, sets.compliance, asked, max_sets - passes)
        passes, single = passes + found.passes, single + found.single
        trial = sets.refined(found.C, found.trial, ENOUGH * tolerance)
        wrong = wrong_signs(found.C, trial, sets.compliance, asked)
        if not wrong.any() or passes == max_sets:
            return _Settled(found.C, trial, passes, single, not wrong.any())
        C = found.C ^ wrong
