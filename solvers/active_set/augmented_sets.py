"""λ and y of the dual problem for a sequence of contact sets, by sparse factorisations; Q is never formed.

Q_CC dλ = −y_C corrects forces λ whose gaps y = g − AᵀK⁻¹(f − Aλ) are not yet closed. With springs of a
stiffness ρ at the contacts of C (augmented Lagrangian; Hestenes, J. Optim. Theory Appl. 4:303–320, 1969),

    (K + ρ A_C A_Cᵀ) v = A_C (dλ − ρ y_C),        dλ ← dλ − ρ (y_C + A_Cᵀv),

and each pass reduces the error by a factor of at least 1 + ρ λmin(Q_CC). One sparse factorisation per set.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Vector
from problems.forms.sparse_factor import Factor, factored
from problems.forms.sparse_prepared import SparsePrepared

from .bordered_factor import Set
from .contact_sets import TrialSolution

STIFFER = 2.0**7  # ρ in units of the stiffest unknown at a contact: more loses digits of K
PASSES = 3  # per correction
MAX_CORRECTIONS = 30

#: λ (m,) → y = g − AᵀK⁻¹(f − Aλ), (m,) mm.
Gap = Callable[[Vector], Vector]


class AugmentedSets:
    """As ContactSets, for an assembly with sparse blocks. p : (m,) mm. diagonal : of Q, mm/N."""

    def __init__(self, prepared: SparsePrepared, p: Vector, diagonal: Vector, gap: Gap) -> None:
        self.prepared, self.p, self.compliance, self.gap = prepared, p, diagonal, gap
        self.Q, self.factorisations = prepared.compliance, 0
        self.factor: Factor | None = None

    @cached_property
    def _K(self) -> sp.csc_array:
        return sp.csc_array(sp.block_diag(self.prepared.assembly.blocks, format="csc"))

    @cached_property
    def _rho(self) -> float:
        A = self.prepared.assembly.A
        stiffest = float(self.prepared.assembly.diagonal_K()[A.indices].max(initial=0.0))
        return STIFFER * stiffest / (float((A.data**2).max(initial=0.0)) or 1.0)

    def at(self, C: Set) -> TrialSolution:
        """λ and y of the set C, with |y_C| no larger than after the last correction that halved it."""
        assembly = self.prepared.assembly
        self.A_C, self.factor = assembly.A[:, np.flatnonzero(C)], None
        if C.any():
            augmented = sp.csc_array(self._K + self._rho * (self.A_C @ self.A_C.T))
            self.factor = factored(augmented, assembly.nodes)
            self.factorisations += 1
        open_everywhere = TrialSolution(
            np.zeros_like(self.p), -self.p, float(abs(self.p[C]).max(initial=0.0))
        )
        return self.refined(C, open_everywhere, 0.0)

    def refined(self, C: Set, trial: TrialSolution, target: float) -> TrialSolution:
        """From the trial solution of the last `at`: |y_C| ≤ target mm, or no longer halving."""
        if self.factor is None:
            return trial
        rows, best = np.flatnonzero(C), trial
        for _ in range(MAX_CORRECTIONS):
            if best.rounding <= target:
                break
            y_C, correction = best.y[rows], np.zeros(rows.size)
            for _ in range(PASSES):
                # (K + ρ A_C A_Cᵀ) v = A_C (dλ − ρ y_C)
                v = self.factor.solve(self.A_C @ (correction - self._rho * y_C))
                correction = correction - self._rho * (y_C + self.A_C.T @ v)
            lam = best.lam.copy()
            lam[rows] += correction
            y = self.gap(lam)
            trial = TrialSolution(lam, y, float(abs(y[rows]).max(initial=0.0)))
            halved = trial.rounding < best.rounding / 2
            best = min(best, trial, key=lambda each: each.rounding)
            if not halved:
                break
        return best
