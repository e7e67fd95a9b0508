"""Factors of a sparse symmetric positive definite K: a band if some numbering gives one, else general.

band        K = LLᵀ in (b + 1) N numbers, LAPACK's dpbtrf; in the numbering as it is, else along the
            longer side of the model, else Cuthill and McKee's, whichever is the first narrow enough
general     SciPy's SuperLU with a fill-reducing order and no pivoting, so that K = LDLᵀ
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import lapack
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from .assembly import Matrix
from .band_solve import band_solve

Order = NDArray[np.intp]

BAND_TO_ROW = 50  # a band at most this many times longer than K's mean row is worth it
WITH_INDICES = 1.5  # numbers of eight bytes per entry of a sparse matrix
COLUMNS_AT_A_TIME = 1024  # that and their entries stay in the processor's cache
LOST = 2.0**-50  # of an unknown's stiffness: a smaller pivot is but the rounding of a zero
SOFT = 2.0**-30  # of an unknown's stiffness: springs that hold a mechanism


class NotPositiveDefinite(np.linalg.LinAlgError):
    """K has a motion that costs no energy; `unknown` is one that moves, by its number."""

    def __init__(self, unknown: int) -> None:
        super().__init__(f"the pivot of unknown {unknown} is not positive")
        self.unknown = unknown


class Factor(Protocol):
    """K⁻¹ through a factorisation."""

    @property
    def numbers(self) -> int:
        """How many float64 it holds."""

    def solve(self, b: Matrix) -> Matrix:
        """K⁻¹ b, b (N,) or (N, k)."""


def factored(K: sp.csc_array, nodes: Matrix | None = None, lost: float = LOST) -> Factor:
    """The factor of K (N, N). nodes : (N, 2) of the unknowns, if known.

    Raises NotPositiveDefinite, also where a pivot is at most `lost` times the entry of K's diagonal.
    """
    widest = _widest(K)
    if half_bandwidth(K) < widest:
        return BandFactor(lower_band(K), lost)
    for order in _orders(K, nodes):
        renumbered = sp.csc_array(K[order][:, order])
        if half_bandwidth(renumbered) < widest:
            return Renumbered(order, lower_band(renumbered), lost)
    return GeneralFactor(K, lost)


def expected_numbers(K: sp.csc_array, nodes: Matrix | None = None) -> int:
    """About how many float64 the factor of K will hold, before it is made; exact for a band.

    Without a narrow band L has about b² log₂ N entries, as in nested dissection of a square grid with that
    half-bandwidth, for each body (George, SIAM J. Numer. Anal. 10:345–363, 1973). L and U are kept, and their
    indices.
    """
    size, widest = K.shape[0], _widest(K)
    numbered = (sp.csc_array(K[order][:, order]) for order in _orders(K, nodes))
    width = size
    for each in itertools.chain([K], numbered):
        width = min(width, half_bandwidth(each))
        if width < widest:
            return size * (width + 1)
    bodies = connected_components(K, directed=False)[0]
    return int(WITH_INDICES * 2 * min(size * width, bodies * width**2 * np.log2(size / bodies)))


def _widest(K: sp.csc_array) -> float:
    """The half-bandwidth below which a band is narrow enough."""
    return BAND_TO_ROW * K.nnz / max(K.shape[0], 1)


def _orders(K: sp.csc_array, nodes: Matrix | None) -> Iterator[Order]:
    if nodes is not None:
        longer, shorter = np.argsort(-np.ptp(nodes, axis=0))
        yield np.lexsort((nodes[:, shorter], nodes[:, longer]))
    yield reverse_cuthill_mckee(sp.csr_matrix(K), symmetric_mode=True)


def half_bandwidth(K: sp.csc_array) -> int:
    """max |i − j| over the entries of K."""
    columns = np.repeat(np.arange(K.shape[1], dtype=K.indices.dtype), np.diff(K.indptr))
    return int((K.indices - columns).max(initial=0))


def lower_band(K: sp.csc_array) -> Matrix:
    """(b + 1, N) column-major, K[j + d, j] in row d, b the half-bandwidth."""
    if not K.has_canonical_format:
        K = K.copy()
        K.sum_duplicates()
    size, width = K.shape[0], half_bandwidth(K)
    band = np.empty((width + 1, size), order="F")  # in large pages, where zeros() would be given small ones
    entries = band.ravel(order="K")
    for start in range(0, size, COLUMNS_AT_A_TIME):
        stop = min(start + COLUMNS_AT_A_TIME, size)
        band[:, start:stop] = 0.0
        stored = slice(K.indptr[start], K.indptr[stop])
        columns = np.repeat(np.arange(start, stop), np.diff(K.indptr[start : stop + 1]))
        rows, values = K.indices[stored], K.data[stored]
        lower = rows >= columns
        # row − column + column (width + 1)
        entries[columns[lower] * width + rows[lower]] = values[lower]
    return band


class BandFactor:
    """L, lower triangular with K = LLᵀ, stored as (b + 1, N): L[j + d, j] in row d. Overwrites `band`."""

    def __init__(self, band: Matrix, lost: float = LOST) -> None:
        smallest = lost * band[0]
        self.L, info = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
        if info:
            raise NotPositiveDefinite(int(info) - 1)
        wrong = np.flatnonzero(self.L[0] ** 2 <= smallest)
        if wrong.size:
            raise NotPositiveDefinite(int(wrong[0]))

    @property
    def numbers(self) -> int:
        return int(self.L.size)

    def solve(self, b: Matrix) -> Matrix:
        return band_solve(self.L, b)


class Renumbered:
    """The band factor of K[order][:, order]."""

    def __init__(self, order: Order, band: Matrix, lost: float = LOST) -> None:
        self.order = order
        try:
            self.band = BandFactor(band, lost)
        except NotPositiveDefinite as error:
            raise NotPositiveDefinite(int(order[error.unknown])) from error

    @property
    def numbers(self) -> int:
        return self.band.numbers

    def solve(self, b: Matrix) -> Matrix:
        x = np.empty_like(b)
        x[self.order] = self.band.solve(b[self.order])
        return x


class GeneralFactor:
    """K = LDLᵀ after a symmetric permutation."""

    def __init__(self, K: sp.csc_array, lost: float = LOST) -> None:
        options = {"SymmetricMode": True}
        try:
            self.lu = splu(K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
        except RuntimeError as error:  # exactly singular
            raise NotPositiveDefinite(_moving_unknown(K)) from error
        order = np.argsort(self.lu.perm_c)
        # Where a pivot on the diagonal is zero, SuperLU takes another row, whose entry may be positive.
        exchanged = np.argsort(self.lu.perm_r) != order
        wrong = np.flatnonzero(~(self.lu.U.diagonal() > lost * abs(K.diagonal()[order])) | exchanged)
        if wrong.size:
            raise NotPositiveDefinite(int(order[wrong[0]]))

    @property
    def numbers(self) -> int:
        return int(self.lu.L.nnz + self.lu.U.nnz)

    def solve(self, b: Matrix) -> Matrix:
        x: Matrix = self.lu.solve(np.asarray(b, dtype=float))
        return x


def _moving_unknown(K: sp.csc_array) -> int:
    """Where K is singular, the unknown that moves most, each in its own unit, if nothing else holds it."""
    size = abs(K).max(axis=1).toarray().ravel()
    size = np.where(size > 0, size, size.max(initial=0.0) or 1.0)
    held = sp.csc_array(K + SOFT * sp.diags_array(size))
    force = np.sqrt(size) * np.random.default_rng(0).standard_normal(len(size))
    return int(np.argmax(abs(splu(held).solve(force)) * np.sqrt(size)))
