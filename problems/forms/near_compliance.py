"""Q = AᵀK⁻¹A for contacts near each other, from the band factors of K's blocks, without the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from .assembly import Assembly, Matrix
from .near_inverse import NearInverse, Rows, near_inverse
from .sparse_factor import BandFactor, Renumbered

FURTHEST = 20  # half-bandwidths between the contacts of a window
SMALL = 2000  # unknowns between them that are never too many


@dataclass(frozen=True)
class _OfBlock:
    """A block's part of Q. places, values : (s, m) the entries of each contact in A, as indices into
    `inverse.rows` and zero-padded values.
    """

    inverse: NearInverse
    places: Rows
    values: Matrix

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
class NearCompliance:
    """Q_WW for the windows W that it was made for."""

    blocks: tuple[_OfBlock, ...]

    def submatrix(self, contacts: Rows) -> Matrix:
        """(k, k), mm/N, stored by columns."""
        Q = np.zeros((len(contacts), len(contacts)), order="F")
        for block in self.blocks:
            block.add_to(Q, contacts)
        return Q


def near_compliance(
    assembly: Assembly,
    factors: Sequence[BandFactor | Renumbered],
    windows: Sequence[Rows],
    single: bool = True,
) -> NearCompliance | None:
    """Of the contacts in each window, in single or double precision.

    None if those of a window are too far apart in the numbering of a band.
    """
    made = []
    for found, unknowns in zip(factors, assembly.slices, strict=True):
        A, factor = sp.csc_array(assembly.A[unknowns]), found
        if isinstance(factor, Renumbered):
            A, factor = sp.csc_array(A[factor.order]), factor.band
        places, values = _padded(A)
        reach = 0
        for contacts in windows:
            used = places[:, contacts][values[:, contacts] != 0]
            reach = max(reach, int(np.ptp(used)) if used.size else 0)
        if reach > max(FURTHEST * len(factor.L), SMALL):
            return None
        rows = np.unique(A.indices).astype(np.intp)
        inverse = near_inverse(factor, rows, reach, single)
        made.append(_OfBlock(inverse, np.searchsorted(rows, places), values))
    return NearCompliance(tuple(made))


def _padded(A: sp.csc_array) -> tuple[Rows, Matrix]:
    """(s, m) row numbers and values of the entries of each column, s the most that one has."""
    counts = np.diff(A.indptr)
    slots = int(counts.max(initial=0))
    column = np.repeat(np.arange(A.shape[1]), counts)
    slot = np.arange(A.nnz) - A.indptr[column]
    places, values = np.zeros((slots, A.shape[1]), dtype=np.intp), np.zeros((slots, A.shape[1]))
    places[slot, column], values[slot, column] = A.indices, A.data
    return places, values
