"""The dual problem with a banded M ≈ Q⁻¹ in place of Q⁻¹, for one contact set after another.

From a point (λ, y) with y exact, the problem with Q replaced by M⁻¹ has λ⁺ = λ + Mz with z = y⁺ − y. For a
set C, N the other contacts, y⁺_C = 0 and λ⁺_N = 0, so that

    z_C = −y_C,    M_NN z_N = (M y_C)_N − λ_N.

In terms of the change z, rounding shrinks with what is left to correct.
"""

from __future__ import annotations

import numpy as np

from problems.forms.assembly import Vector
from problems.forms.banded_inverse import BandedInverse, BandFactor

from .block_pivoting import SIGN_UNCERTAINTY, Set, TrialSolution


class BandedSets:
    """λ⁺ and y⁺ of the sets C. factor : of M on an open set, kept from set to set.

    All vectors are in the order of M; `start.rounding` is |y_C| at the point.
    """

    def __init__(self, M: BandedInverse, start: TrialSolution, factor: BandFactor | None) -> None:
        self.M, self.start, self.factor = M, start, factor
        self.uncertainty = SIGN_UNCERTAINTY * start.rounding

    def at(self, C: Set) -> TrialSolution:
        N, lam, y = ~C, self.start.lam, self.start.y
        if self.factor is None or (self.factor.S ^ N).any():
            self.factor = self.M.factor(N)
        y_C = np.where(C, y, 0.0)
        z: Vector = self.factor.solve(self.M.product(y_C) - lam) - y_C
        return TrialSolution(
            np.where(C, lam + self.M.product(z), 0.0), np.where(C, 0.0, y + z), self.uncertainty
        )
