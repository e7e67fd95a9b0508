"""Constraints that enter and leave the active set; many of these changes share one factorisation.

For the initial active set C, G_CC = RᵀR. An entering constraint k and a leaving one, the j-th of C, are
columns of a border (see bordered_factor.py) with W_k = G_Ck and W_j = e_j. Stored for each are D = R⁻ᵀW,
V = R⁻¹D and its row of S = G_EE − DᵀD, without the first term for leaving ones. With E the columns
currently in use, raising u_k by one while the active slacks stay zero changes

    u_E by −r_E,  r_E = S_EE⁻¹ S_Ek,    u_C by −r_C,  r_C = V_k − V_E r_E,    s by S_k − S_E r_E:

products with a few columns instead of two solves with R.
"""

import numpy as np
from scipy.linalg import lapack

from problems.forms.assembly import Indices, Matrix, Vector

from .growing_factor import GrowingFactor


class Border:
    """candidates : the constraints that may enter, the first columns. V is row-major."""

    def __init__(self, G: Matrix, C: Indices, factor: GrowingFactor, candidates: Indices) -> None:
        self.C, self.factor = C, factor
        self.candidates = candidates
        self.D = factor.solve_transposed(G[np.ix_(C, candidates)])
        self.V = np.ascontiguousarray(factor.solve(self.D).T)
        self.S = G[np.ix_(candidates, candidates)] - self.D.T @ self.D
        self.removed: list[int] = []  # positions in C; their columns follow those of the candidates
        self.added: list[int] = []  # columns of the active candidates

    @property
    def active(self) -> Indices:
        """C, including the removed constraints, then the added candidates."""
        return np.append(self.C, self.candidates[self.added])

    def direction(self, column: int) -> tuple[Vector, Vector]:
        """(r, ds) for the candidate in `column`: r for `active`, ds for the candidates.

        Raises LinAlgError if the active constraints are linearly dependent.
        """
        n = len(self.candidates)
        r_C, r_E, ds = self.V[column].copy(), np.empty(0), self.S[:n, column]
        E = self.added + list(range(n, len(self.S)))
        if E:
            _, _, r_E, info = lapack.dgesv(self.S[np.ix_(E, E)], self.S[E, column])
            if info:
                raise np.linalg.LinAlgError("the active constraints are linearly dependent")
            r_C -= r_E @ self.V[E]
            ds = ds - self.S[:n, E] @ r_E
        r_C[self.removed] = 0.0
        return np.append(r_C, r_E[: len(self.added)]), ds

    def drop(self, place: int) -> None:
        """Remove the constraint at this position of `active`."""
        if place >= len(self.C):
            del self.added[place - len(self.C)]
            return
        unit = (np.arange(len(self.C)) == place).astype(float)
        v = self.factor.solve(self.factor.solve_transposed(unit))
        row = -np.append(self.V[:, place], v[place])
        self.S = np.block([[self.S, row[:-1, None]], [row]])
        self.V = np.vstack([self.V, v])
        self.removed.append(place)
