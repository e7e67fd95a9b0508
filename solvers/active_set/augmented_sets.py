"""λ and y of the dual problem for a sequence of contact sets, by sparse factorisations; Q is never formed.

Q_CC dλ = −y_C corrects forces λ whose gaps y = g − AᵀK⁻¹(f − Aλ) are not yet closed. With springs of a
stiffness ρ at the contacts of C (augmented Lagrangian; Hestenes, J. Optim. Theory Appl. 4:303–320, 1969),

    (Q_CC + I/ρ)⁻¹ r = ρ (r − A_Cᵀv),        (K + ρ A_C A_Cᵀ) v = ρ A_C r,

which is almost Q_CC⁻¹, but for motions that nearly dependent contacts hardly resist, with λ(Q_CC) < 1/ρ: as
a preconditioner of conjugate gradients it takes one step more for each of these. One sparse factorisation
per set.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, cg

from problems.forms.assembly import Assembly, Vector
from problems.forms.prepared import Prepared
from problems.stiffness.block import Block
from problems.stiffness.sparse import sparse_block

from .bordered_factor import Set
from .contact_sets import TrialSolution

STIFFER = 2.0**7  # ρ in units of the stiffest unknown at a contact: more loses digits of K
REDUCTION, STEPS = 1e-3, 20  # of |y_C| by a correction, and the steps it may take
MAX_CORRECTIONS = 30

#: λ (m,) → y = g − AᵀK⁻¹(f − Aλ), (m,) mm.
Gap = Callable[[Vector], Vector]


def stiffest_contact(assembly: Assembly) -> float:
    """That of the stiffest unknown at a contact, for a spring at that contact."""
    stiffest = float(assembly.K.diagonal[assembly.A.indices].max(initial=0.0))
    return stiffest / (float((assembly.A.data**2).max(initial=0.0)) or 1.0)


class AugmentedSets:
    """As ContactSets, for an assembly with sparse blocks. p : (m,) mm. diagonal : of Q, mm/N."""

    def __init__(self, prepared: Prepared, p: Vector, diagonal: Vector, gap: Gap) -> None:
        self.prepared, self.p, self.compliance, self.gap = prepared, p, diagonal, gap
        self.Q, self.factorisations = prepared.compliance, 0
        self.factor: Block | None = None

    @cached_property
    def _K(self) -> sp.csc_array:
        return self.prepared.assembly.K.matrix

    @cached_property
    def _rho(self) -> float:
        return STIFFER * stiffest_contact(self.prepared.assembly)

    def at(self, C: Set) -> TrialSolution:
        """λ and y of the set C, with |y_C| no larger than after the last correction that halved it."""
        assembly = self.prepared.assembly
        self.A_C, self.factor = assembly.A[:, np.flatnonzero(C)], None
        if C.any():
            augmented = sp.csc_array(self._K + self._rho * (self.A_C @ self.A_C.T))
            self.factor = sparse_block(augmented, assembly.nodes)
            self.factorisations += 1
        open_everywhere = TrialSolution(
            np.zeros_like(self.p), -self.p, float(abs(self.p[C]).max(initial=0.0))
        )
        return self.refined(C, open_everywhere, 0.0)

    def _almost_inverse(self, factor: Block, r: Vector) -> Vector:
        """(Q_CC + I/ρ)⁻¹ r."""
        return self._rho * (r - self.A_C.T @ factor.solve(self.A_C @ (self._rho * r)))

    @np.errstate(over="ignore", invalid="ignore")
    def refined(self, C: Set, trial: TrialSolution, target: float) -> TrialSolution:
        """From the trial solution of the last `at`: |y_C| ≤ target mm, or no longer halving."""
        if self.factor is None:
            return trial
        rows, best, factor = np.flatnonzero(C), trial, self.factor
        shape = (rows.size, rows.size)
        Q_CC = LinearOperator(shape, self.Q.submatrix(rows).__matmul__, dtype=float)
        almost_inverse = LinearOperator(shape, lambda r: self._almost_inverse(factor, r), dtype=float)
        for _ in range(MAX_CORRECTIONS):
            if best.rounding <= target:
                break
            correction, _ = cg(Q_CC, -best.y[rows], M=almost_inverse, rtol=REDUCTION, maxiter=STEPS)
            lam = best.lam.copy()
            lam[rows] += correction
            y = self.gap(lam)
            trial = TrialSolution(lam, y, float(abs(y[rows]).max(initial=0.0)))
            halved = trial.rounding < best.rounding / 2
            best = min(best, trial, key=lambda each: each.rounding)
            if not halved:
                break
        return best
