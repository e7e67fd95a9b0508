"""The dual problem with a banded M ≈ Q⁻¹ in place of Q⁻¹, for one contact set after another.

From a point (λ, y) with y exact, the problem with Q replaced by M⁻¹ has λ⁺ = λ + Mz with z = y⁺ − y. For a
set C, N the other contacts, y⁺_C = 0 and λ⁺_N = 0, so that

    z_C = −y_C,    M_NN z_N = (M y_C)_N − λ_N.

In terms of the change z, rounding shrinks with what is left to correct.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Mask, Vector
from problems.forms.banded_inverse import BandedInverse, BandFactor

from .block_pivoting import SIGN_UNCERTAINTY, TrialSolution


@dataclass
class OpenFactor:
    """M, and its Cholesky factor on an open set, kept until another one is asked for."""

    M: BandedInverse
    last: BandFactor | None = None

    def __call__(self, N: Mask) -> BandFactor:
        if self.last is None or (self.last.S ^ N).any():
            self.last = self.M.factor(N)
        return self.last


def banded_set(factor: OpenFactor, start: TrialSolution, C: Mask) -> TrialSolution:
    """λ⁺ and y⁺ of the set C; all vectors are in the order of M, `start.rounding` is |y_C| at the point."""
    M, lam, y = factor.M, start.lam, start.y
    y_C = np.where(C, y, 0.0)
    z: Vector = factor(~C).solve(M.product(y_C) - lam) - y_C
    new = np.where(C, lam + M.product(z), 0.0)
    return TrialSolution(new, np.where(C, 0.0, y + z), SIGN_UNCERTAINTY * start.rounding)
