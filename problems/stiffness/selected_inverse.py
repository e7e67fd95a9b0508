"""Entries of K⁻¹ near the diagonal, from the band factor K = LLᵀ, and from them entries of Q = AᵀK⁻¹A for
contacts near each other.

With the unknowns in blocks as wide as the band, L has blocks on the diagonal and beside it, and with
U_i = L_{i+1,i} L_ii⁻¹ the blocks of Z = K⁻¹ follow from the last to the first (Takahashi, Fagan and Chen,
8th PICA Conf., 1973, block by block):

    Z_ii = (L_ii L_iiᵀ)⁻¹ + U_iᵀ Z_{i+1,i+1} U_i,        Z_ij = −U_iᵀ Z_{i+1,j},   j > i.

L_ii and L_{i+1,i} are triangular, so that a block takes about 4⅓ b³ operations. They are done in single
precision where that suffices for a preconditioner. Off the diagonal only the columns needed are formed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import blas, lapack

from . import Indices, Matrix
from .band_factor import Entries, band_blocks

UNBLOCKED = 64  # LAPACK's inverse of a triangle is slower than products beyond that
FURTHEST = 20  # half-bandwidths between the contacts of a window
SMALL = 2000  # unknowns between them that are never too many


@dataclass(frozen=True)
class SelectedInverse:
    """K⁻¹ at rows that are at most some distance apart.

    rows : the unknowns needed, ascending. starts : (blocks + 1,) where those of each block begin.
    panels : for each block, its rows of K⁻¹ at the unknowns of this and the following blocks.
    """

    rows: Indices
    starts: Indices
    panels: tuple[Entries, ...]

    def submatrix(self, start: int, stop: int) -> Entries:
        """K⁻¹ at rows[start:stop], which must be within the reach."""
        Z = np.empty((stop - start, stop - start), dtype=self.panels[0].dtype)
        first = int(np.searchsorted(self.starts, start, side="right")) - 1
        for block in range(first, len(self.panels)):
            begin, end = max(self.starts[block], start), min(self.starts[block + 1], stop)
            if begin >= stop:
                break
            offset = self.starts[block]
            part = self.panels[block][begin - offset : end - offset, begin - offset : stop - offset]
            Z[begin - start : end - start, begin - start :] = part
            Z[begin - start :, begin - start : end - start] = part.T
        return Z


def selected_inverse(L: Entries, rows: Indices, reach: int, single: bool = True) -> SelectedInverse:
    """K⁻¹ at pairs of `rows`, ascending, that are at most `reach` unknowns apart. single : the precision."""
    dtype = np.float32 if single else np.float64
    trmm = blas.strmm if single else blas.dtrmm
    size = L.shape[1]
    width = max(L.shape[0] - 1, 1)
    edges = np.arange(0, size + width, width).clip(max=size)
    count, further = len(edges) - 1, -(-reach // width)
    starts = np.searchsorted(rows, edges)
    panels: list[Entries] = [np.zeros((0, 0), dtype)] * count
    Z = np.zeros((width, width), dtype, order="F")
    columns = np.zeros((width, 0), dtype, order="F")  # Z_{i+1,j} at the columns needed, j = i + 1, …
    for i in reversed(range(count)):
        diagonal, B = band_blocks(L, int(edges[i]), int(edges[i + 1]), width, dtype)
        if len(B) < width:
            diagonal, B = _continued(diagonal, B, width)
        inverse = _inverse(diagonal, single)
        # Z_ii = L_ii⁻ᵀ (I + BᵀZB) L_ii⁻¹, B = L_{i+1,i}, in place
        Z = trmm(1.0, B, trmm(1.0, B, Z, side=1, overwrite_b=1), trans_a=1, overwrite_b=1)
        Z[np.diag_indices(width)] += 1
        Z = trmm(1.0, inverse, Z, side=1, lower=1, overwrite_b=1)
        Z = trmm(1.0, inverse, Z, lower=1, trans_a=1, overwrite_b=1)
        after = columns[:, : starts[min(i + 1 + further, count)] - starts[min(i + 1, count)]]
        if after.size:
            after = trmm(-1.0, inverse, trmm(1.0, B, after, trans_a=1), lower=1, trans_a=1, overwrite_b=1)
        inside = rows[starts[i] : starts[i + 1]] - edges[i]
        columns = np.asfortranarray(np.hstack([Z[:, inside], after]))
        panels[i] = columns[inside]
    return SelectedInverse(rows, starts, tuple(panels))


def _continued(diagonal: Entries, below: Entries, width: int) -> tuple[Entries, Entries]:
    """The blocks extended to (width, width), as if K continued as the identity."""
    size, dtype = len(diagonal), diagonal.dtype
    D, B = np.eye(width, dtype=dtype, order="F"), np.zeros((width, width), dtype, order="F")
    D[:size, :size], B[: len(below), :size] = diagonal, below
    return D, B


def _inverse(L: Entries, single: bool) -> Entries:
    """L⁻¹ by halves: (P 0; R S)⁻¹ = (P⁻¹ 0; −S⁻¹RP⁻¹ S⁻¹)."""
    if len(L) <= UNBLOCKED:
        inverse: Entries = (lapack.strtri if single else lapack.dtrtri)(L, lower=1)[0]
        return inverse
    half, trmm = len(L) // 2, blas.strmm if single else blas.dtrmm
    inverse = np.zeros_like(L, order="F")
    P, S = _inverse(L[:half, :half], single), _inverse(L[half:, half:], single)
    inverse[:half, :half], inverse[half:, half:] = P, S
    inverse[half:, :half] = trmm(-1.0, S, trmm(1.0, P, L[half:, :half], side=1, lower=1), lower=1)
    return inverse


@dataclass(frozen=True)
class BlockPart:
    """The part of Q that one block of K contributes.

    places, values : (s, m) the entries of each contact in A: indices into `inverse.rows`, padded values.
    """

    inverse: SelectedInverse
    places: Indices
    values: Matrix

    @classmethod
    def of(cls, L: Entries, A: sp.csc_array, windows: Sequence[Indices], single: bool) -> "BlockPart | None":
        """The part from the band factor K = LLᵀ, for the contacts in each window.

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

    def add_to(self, Q: Matrix, contacts: Indices) -> None:
        """Add the part to Q at some contacts of a window."""
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


def _padded(A: sp.csc_array) -> tuple[Indices, Matrix]:
    """(s, m) row numbers and values of the entries of each column, s the most that one has."""
    counts = np.diff(A.indptr)
    slots = int(counts.max(initial=0))
    column = np.repeat(np.arange(A.shape[1]), counts)
    slot = np.arange(A.nnz) - A.indptr[column]
    places, values = np.zeros((slots, A.shape[1]), dtype=np.intp), np.zeros((slots, A.shape[1]))
    places[slot, column], values[slot, column] = A.indices, A.data
    return places, values
