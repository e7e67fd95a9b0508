"""The dual problem with a banded M ≈ Q⁻¹ in place of Q⁻¹, for one contact set after another.

From a point (λ, y) with y exact, the problem with Q replaced by M⁻¹ has the gaps y⁺ = y + M⁻¹(λ⁺ − λ):

    λ⁺ = (λ − My) + My⁺,    λ⁺ = 0 off C,    y⁺ = 0 on C
"""

from __future__ import annotations

import numpy as np

from problems.forms.banded_inverse import BandedInverse, BandFactor

from .bordered_factor import Set
from .contact_sets import TrialSolution

SIGN_UNCERTAINTY = 1e-5  # of |y_C| at the point: smaller values have no reliable sign


class BandedSets:
    """λ⁺ and y⁺ of the sets C. factor : of M on an open set, kept from set to set.

    All vectors are in the order of M; `start.rounding` is |y_C| at the point.
    """

    def __init__(self, M: BandedInverse, start: TrialSolution, factor: BandFactor | None) -> None:
        self.M, self.b, self.factor = M, start.lam - M.product(start.y), factor
        self.uncertainty = SIGN_UNCERTAINTY * start.rounding

    def at(self, C: Set) -> TrialSolution:
        N = ~C
        if self.factor is None or (self.factor.S ^ N).any():
            self.factor = self.M.factor(N)
        y = -self.factor.solve(self.b)
        return TrialSolution(np.where(C, self.b + self.M.product(y), 0.0), y, self.uncertainty)
