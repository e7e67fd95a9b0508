"""Constraints that enter and leave the active set, with one factor for many of them.

For the active set C that they start from, G_CC = RᵀR. One that enters, k, and one that leaves, the j-th
of C, are columns of a border (see bordered_factor.py) with W_k = G_Ck and W_j = e_j; kept of each are
D = R⁻ᵀW, V = R⁻¹D and its row of S = G_EE − DᵀD, without the first term for those that leave. With E the
columns that count now, raising u_k by one while the active slacks stay zero changes

    u_E by −r_E,  r_E = S_EE⁻¹ S_Ek,    u_C by −r_C,  r_C = V_k − V_E r_E,    s by S_k − S_E r_E:

products with a few columns in the place of two solves with R.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from problems.forms.assembly import Matrix, Vector

from .growing_factor import GrowingFactor

Indices = NDArray[np.intp]


class Border:
    """candidates : the constraints that may enter, the first columns. V is stored by rows."""

    def __init__(self, G: Matrix, C: Indices, factor: GrowingFactor, candidates: Indices) -> None:
        self.C, self.factor = C, factor
        self.candidates = candidates
        self.D = factor.solve_transposed(G[np.ix_(C, candidates)])
        self.V = np.ascontiguousarray(factor.solve(self.D).T)
        self.S = G[np.ix_(candidates, candidates)] - self.D.T @ self.D
        self.left: list[int] = []  # positions in C; their columns come after the candidates'
        self.entered: list[int] = []  # columns of the candidates that are active

    @property
    def active(self) -> Indices:
        """C, those that left among them, and the candidates that entered."""
        return np.append(self.C, self.candidates[self.entered])

    def direction(self, column: int) -> tuple[Vector, Vector]:
        """(r, ds) for the candidate of that column: r of `active`, ds of the candidates.

        Raises LinAlgError where the active constraints depend on each other.
        """
        n = len(self.candidates)
        r_C, r_E, ds = self.V[column].copy(), np.empty(0), self.S[:n, column]
        E = self.entered + list(range(n, len(self.S)))
        if E:
            _, _, r_E, info = lapack.dgesv(self.S[np.ix_(E, E)], self.S[E, column])
            if info:
                raise np.linalg.LinAlgError("the active constraints depend on each other")
            r_C -= r_E @ self.V[E]
            ds = ds - self.S[:n, E] @ r_E
        r_C[self.left] = 0.0
        return np.append(r_C, r_E[: len(self.entered)]), ds

    def drop(self, place: int) -> None:
        """The constraint of that place in `active` is active no longer."""
        if place >= len(self.C):
            del self.entered[place - len(self.C)]
        else:
            self._leave(place)

    def _leave(self, position: int) -> None:
        unit = np.zeros(self.V.shape[1])
        unit[position] = 1.0
        v = self.factor.solve(self.factor.solve_transposed(unit))
        row = -np.append(self.V[:, position], v[position])
        self.S = np.block([[self.S, row[:-1, None]], [row]])
        self.V = np.vstack([self.V, v])
        self.left.append(position)
