"""λ and y of the dual problem for a sequence of contact sets, by sparse factorisations; Q is never formed.

Q_CC λ_C = p_C is the equilibrium of v = K⁻¹Aλ under prescribed overlaps A_Cᵀv = p_C. With springs of a
stiffness ρ at the closed contacts (augmented Lagrangian; Hestenes, J. Optim. Theory Appl. 4:303–320, 1969),

    (K + ρ A_C A_Cᵀ) v = A_C (λ_C + ρ p_C),        λ_C ← λ_C + ρ (p_C − A_Cᵀ v),

and each pass reduces the error by a factor of at least 1 + ρ λmin(Q_CC). One sparse factorisation per set.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Vector
from problems.forms.sparse_factor import Factor, factored
from problems.forms.sparse_prepared import SparsePrepared

from .bordered_factor import Set
from .contact_sets import TrialSolution

STIFFER = 1e4  # ρ in units of the stiffest unknown at a contact
MAX_PASSES = 30


class AugmentedSets:
    """As ContactSets, for an assembly with sparse blocks. p : (m,) mm. diagonal : of Q, mm/N."""

    def __init__(self, prepared: SparsePrepared, p: Vector, diagonal: Vector) -> None:
        self.prepared, self.p, self.compliance = prepared, p, diagonal
        self.Q, self.factorisations = prepared.compliance, 0

    @cached_property
    def _K(self) -> sp.csc_array:
        return sp.csc_array(sp.block_diag(self.prepared.assembly.blocks, format="csc"))

    @cached_property
    def _rho(self) -> float:
        A = self.prepared.assembly.A
        stiffest = float(self.prepared.assembly.diagonal_K()[A.indices].max(initial=0.0))
        return STIFFER * stiffest / float((A.data**2).max(initial=1.0))

    def at(self, C: Set) -> TrialSolution:
        """λ and y of the set C, with |y_C| no larger than after the last pass that halved it."""
        assembly = self.prepared.assembly
        A_C = assembly.A[:, np.flatnonzero(C)]
        self.factor: Factor | None = None
        if C.any():
            augmented = sp.csc_array(self._K + self._rho * (A_C @ A_C.T))
            self.factor = factored(augmented, assembly.nodes)
            self.factorisations += 1
        return self._continued(C, TrialSolution(np.zeros_like(self.p), -self.p, np.inf), 0.0)

    def refined(self, C: Set, trial: TrialSolution, target: float) -> TrialSolution:
        """The trial solution of the last `at`, with |y_C| ≤ target mm or no longer halving."""
        return self._continued(C, trial, target)

    def _continued(self, C: Set, trial: TrialSolution, target: float) -> TrialSolution:
        if self.factor is None:
            return TrialSolution(np.zeros_like(self.p), -self.p, 0.0)
        rows, A = np.flatnonzero(C), self.prepared.assembly.A
        A_C, best = A[:, rows], trial
        for _ in range(MAX_PASSES):
            if best.rounding <= target:
                break
            # (K + ρ A_C A_Cᵀ) v = A_C (λ_C + ρ p_C)
            v = self.factor.solve(A_C @ (best.lam[rows] + self._rho * self.p[rows]))
            lam = best.lam.copy()
            lam[rows] += self._rho * (self.p[rows] - A_C.T @ v)
            y = self.Q @ lam - self.p
            trial = TrialSolution(lam, y, float(abs(y[rows]).max(initial=0.0)))
            improving = trial.rounding < best.rounding / 2
            best = min(best, trial, key=lambda each: each.rounding)
            if not improving:
                break
        return best
