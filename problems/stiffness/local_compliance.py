"""Q = AᵀK⁻¹A for contacts near each other, from the selected inverse of K's blocks, without the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from .selected_inverse import SelectedInverse, selected_inverse

FURTHEST = 20  # half-bandwidths between the contacts of a window
SMALL = 2000  # unknowns between them that are never too many

Rows = NDArray[np.intp]
Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class BlockPart:
    """A block's part of Q. places, values : (s, m) the entries of each contact in A, as indices into
    `inverse.rows` and zero-padded values.
    """

    inverse: SelectedInverse
    places: Rows
    values: Matrix

    @classmethod
    def of(cls, L: Matrix, A: sp.csc_array, windows: Sequence[Rows], single: bool) -> BlockPart | None:
        """From the band factor K = LLᵀ, for the contacts in each window; in single or double precision.

        None if those of a window are too far apart in the numbering of the band.
        """
        places, values = _padded(A)
        reach = 0
        for contacts in windows:
            used = places[:, contacts][values[:, contacts] != 0]
            reach = max(reach, int(np.ptp(used)) if used.size else 0)
        if reach > max(FURTHEST * len(L), SMALL):
            return None
        rows = np.unique(A.indices).astype(np.intp)
        return cls(selected_inverse(L, rows, reach, single), np.searchsorted(rows, places), values)

    def add_to(self, Q: Matrix, contacts: Rows) -> None:
        places, values = self.places[:, contacts], self.values[:, contacts]
        used = values != 0
        if not used.any():
            return
        start, stop = int(places[used].min()), int(places[used].max()) + 1
        Z = self.inverse.submatrix(start, stop)
        places = np.where(used, places - start, 0)
        for row, left in zip(places, values, strict=True):
            for column, right in zip(places, values, strict=True):
                Q += left[:, None] * Z[np.ix_(row, column)] * right


@dataclass(frozen=True)
class LocalCompliance:
    """Q_WW for the windows W that it was made for."""

    parts: tuple[BlockPart, ...]

    def __call__(self, contacts: Rows) -> Matrix:
        """(k, k), mm/N, stored by columns."""
        Q = np.zeros((len(contacts), len(contacts)), order="F")
        for part in self.parts:
            part.add_to(Q, contacts)
        return Q


def _padded(A: sp.csc_array) -> tuple[Rows, Matrix]:
    """(s, m) row numbers and values of the entries of each column, s the most that one has."""
    counts = np.diff(A.indptr)
    slots = int(counts.max(initial=0))
    column = np.repeat(np.arange(A.shape[1]), counts)
    slot = np.arange(A.nnz) - A.indptr[column]
    places, values = np.zeros((slots, A.shape[1]), dtype=np.intp), np.zeros((slots, A.shape[1]))
    places[slot, column], values[slot, column] = A.indices, A.data
    return places, values
