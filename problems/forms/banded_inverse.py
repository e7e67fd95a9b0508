"""A factorised sparse approximate inverse (FSAI) M ≈ Q⁻¹ with a narrow band.

Q is a Green's function: the state of a contact is almost determined by its neighbourhood, and Q⁻¹, a
stiffness, is almost zero between distant contacts. With the contacts ordered along the joint, each row of
the Cholesky factor of Q⁻¹ is computed from the contacts just before it (L. Yu. Kolotilina and A. Yu. Yeremin,
SIAM J. Matrix Anal. Appl. 14:45–58, 1993): for a window W of contacts that ends with the current line,
Q_WW = LLᵀ, and the last rows of L⁻¹ are those of the line. M is the sum of the outer products of these rows
with themselves: positive definite for any window, and equal to Q⁻¹ if a window holds all contacts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import blas, lapack

from problems.stiffness.band_factor import band_cholesky

from .assembly import Indices, Mask, Matrix, Vector

WINDOW_LINES = 4  # lines of contacts across the joint in a window, before the current one
DEFAULT_LINE = 16  # contacts per line if coordinates are unknown
COLUMNS_AT_A_TIME = 256  # their indices stay in the processor's cache


@dataclass(frozen=True)
class BandedInverse:
    """M as a symmetric band.

    order : (m,) the contacts along the joint; all vectors are in this order.
    band : (b + 2, m) column-major, M[j + d, j] in row d, the last row zero.
    """

    order: Indices
    band: Matrix

    def product(self, v: Vector) -> Vector:
        """M v."""
        return blas.dsbmv(len(self.band) - 1, 1.0, self.band, v, lower=1)

    def factor(self, S: Mask, room: Vector | None = None) -> BandFactor:
        """The Cholesky factor of M_SS. Raises LinAlgError if rounding makes it indefinite.

        room : memory for the factor, as many numbers as the band has; by default it is allocated.
        """
        rows, width = np.flatnonzero(S), len(self.band) - 1
        nearer = np.arange(len(rows)) - np.searchsorted(rows, rows - width)
        deep = int(nearer.max(initial=0)) + 1
        room = np.empty(deep * len(rows)) if room is None else room[: deep * len(rows)]
        block = room.reshape((deep, len(rows)), order="F")
        entries = self.band.ravel(order="K")
        # Entry (i + d, i) of M_SS is entry (rows[i + d], rows[i]) of M, zero beyond the band.
        below = np.lib.stride_tricks.sliding_window_view(np.append(rows, np.full(deep, 2 * len(S))), deep)
        for start in range(0, len(rows), COLUMNS_AT_A_TIME):
            column = rows[start : start + COLUMNS_AT_A_TIME, None]
            apart = np.minimum(below[start : start + len(column)] - column, width)
            block.T[start : start + len(column)] = entries.take(apart + column * len(self.band))
        return BandFactor.of(S, rows, block)

    def scaled(self, s: Vector) -> BandedInverse:
        """diag(s) M diag(s)."""
        below = np.lib.stride_tricks.sliding_window_view(np.pad(s, (0, len(self.band) - 1)), len(self.band))
        band = np.empty_like(self.band)
        for start in range(0, len(s), COLUMNS_AT_A_TIME):
            some = slice(start, start + COLUMNS_AT_A_TIME)
            np.multiply(self.band[:, some], below.T[:, some] * s[some], out=band[:, some])
        return BandedInverse(self.order, band)

    def shifted_factor(self, s: Vector) -> BandFactor:
        """The Cholesky factor of I + diag(s) M diag(s)."""
        return BandFactor.stiffened(self.scaled(s).band, 1.0)

    def stiffened_factor(self, d: Vector) -> BandFactor:
        """The Cholesky factor of M + diag(d). Raises LinAlgError if rounding makes it indefinite."""
        return BandFactor.stiffened(np.array(self.band[:-1], order="F"), d)


@dataclass(frozen=True)
class BandFactor:
    """The Cholesky factor L of M_SS, S a set of contacts and rows its indices."""

    S: Mask
    rows: Indices
    L: Matrix

    @classmethod
    def of(cls, S: Mask, rows: Indices, band: Matrix) -> BandFactor:
        """The factor of a band of M_SS, column-major, which is overwritten. Raises LinAlgError if it is not
        positive definite.
        """
        L, info = band_cholesky(band) if rows.size else (band, 0)
        if info:
            raise np.linalg.LinAlgError(f"the leading minor {info} of M_SS is not positive definite")
        return cls(S, rows, L)

    @classmethod
    def stiffened(cls, band: Matrix, d: Vector | float) -> BandFactor:
        """The factor of M + diag(d) on all contacts. band : of M, as in `of`."""
        band[0] += d
        every = np.ones(band.shape[1], dtype=bool)
        return cls.of(every, np.arange(len(every)), band)

    def solve(self, b: Vector) -> Vector:
        """u (m,) with M_SS u_S = b_S and zero elsewhere."""
        u = np.zeros(len(b))
        if self.rows.size:
            u[self.rows] = lapack.dpbtrs(self.L, b[self.rows], lower=1)[0]
        return u


def banded_inverse(Q: Matrix, windows: Windows) -> BandedInverse:
    """M ≈ Q⁻¹ from windows of Q (m, m). Raises LinAlgError if Q is not positive definite."""
    rows = np.asarray(Q).T  # no memory map, whose views cost more than their copies
    return of_windows(windows, lambda window: rows[np.ix_(window, window)].T)


def of_windows(windows: Windows, Q_WW: Callable[[Indices], Matrix]) -> BandedInverse:
    """M ≈ Q⁻¹ from the principal submatrices of Q that `Q_WW` gives.

    Q_WW : a window of contacts → its submatrix as a new array, stored by columns; it is overwritten.
    Raises LinAlgError if one is not positive definite.
    """
    m, across = len(windows.order), windows.across
    band = np.zeros((min((WINDOW_LINES + 1) * across, m) + 1, m), order="F")
    down, right = band.strides
    for first, start, stop in windows.ranges():
        L, info = lapack.dpotrf(Q_WW(windows.order[first:stop]), lower=1, clean=0, overwrite_a=1)
        if info:
            raise np.linalg.LinAlgError(f"the leading minor {info} of Q_WW is not positive definite")
        unit = np.eye(stop - first, stop - start, first - start, order="F")
        rows = lapack.dtrtrs(L, unit, lower=1, trans=1, overwrite_b=1)[0]
        # Entry (i, j) of the window is band[i − j, first + j]: a view with a slanted stride, right for i ≥ j.
        window = np.lib.stride_tricks.as_strided(
            band[:, first:], shape=(stop - first, stop - first), strides=(down, right - down)
        )
        window += blas.dsyrk(1.0, rows, lower=1)  # zero above the diagonal
    return BandedInverse(windows.order, band)


@dataclass(frozen=True)
class Windows:
    """Contacts in lines across the joint. order : (m,) along the joint. across : contacts per line."""

    order: Indices
    across: int

    @classmethod
    def of(cls, nodes: Matrix | None, m: int) -> Windows:
        """Lines of m contacts along the longer side of the joint. nodes : (m, 2), mm, if they are known."""
        if nodes is None:
            return cls(np.arange(m), min(DEFAULT_LINE, m))
        extent = np.ptp(nodes, axis=0)
        longer, shorter = (0, 1) if extent[0] >= extent[1] else (1, 0)
        order = np.lexsort((nodes[:, shorter], nodes[:, longer]))
        x = nodes[order, longer]
        places = 1 + np.diff(nodes[order], axis=0).any(axis=1).sum()
        spacing = np.sqrt(np.prod(extent) / places) if extent.all() else extent.max() / places
        between = extent[longer] / max(np.count_nonzero(np.diff(x) > 1e-9 * spacing), 1)
        if spacing / 2 <= between <= spacing:  # the contacts stand in lines
            spacing = between
        line = np.arange(m) - np.searchsorted(x, x - spacing * (1 - 1e-9)) + 1
        return cls(order, int(line.max()))

    def ranges(self) -> Iterator[tuple[int, int, int]]:
        """(start of its window, start, end) of each line of contacts, as places in the order."""
        m, across = len(self.order), self.across
        for start in range(0, m, across):
            yield max(start - WINDOW_LINES * across, 0), start, min(start + across, m)

    @property
    def factorisation_flops(self) -> float:
        """Operations of a Cholesky factorisation of M."""
        return float(len(self.order) * ((WINDOW_LINES + 1) * self.across) ** 2)

    @property
    def work(self) -> float:
        """Operations of `of_windows`: per line with w contacts in its window w³/3 + 2w² across."""
        starts = np.arange(0, len(self.order), self.across)
        line = np.minimum(self.across, len(self.order) - starts)
        window = line + np.minimum(starts, WINDOW_LINES * self.across)
        return float((window**3.0 / 3 + 2.0 * window**2 * line).sum())

    def contacts(self) -> list[Indices]:
        """The contacts of each window."""
        return [self.order[first:stop] for first, _, stop in self.ranges()]
