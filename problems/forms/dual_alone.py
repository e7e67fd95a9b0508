"""A dual program by itself, Q and p without a joint: that of K = Q⁻¹, A = I, f = 0, g = −p."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from .assembly import Assembly, LoadCase, Matrix, Vector
from .prepared import Prepared


class DualAlone(Prepared):
    """Q (m, m) symmetric positive definite, mm/N, with K⁻¹ = Q; K itself is not there."""

    def __init__(self, Q: Matrix) -> None:
        super().__init__(Assembly((), sp.eye_array(len(Q), format="csc")), Q=Q)

    def solve_K(self, b: Matrix) -> Matrix:
        return self.Q @ b

    def recover(self, lam: Vector, load: LoadCase) -> Vector:
        """x = Q(f − λ), mm."""
        return self.Q @ (load.f - lam)


def load_of(p: Vector) -> LoadCase:
    """The load case with AᵀK⁻¹f − g = p, (m,) mm."""
    return LoadCase(np.zeros(len(p)), -p)
