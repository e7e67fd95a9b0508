"""Numbers known to within an error: sums of two float64, products without rounding, norms from above.

Sums are error-free: two_sum returns the rounding error beside the result (Knuth), and terms are added with
their rounding errors (Ogita, Rump and Oishi, SIAM J. Sci. Comput. 26:1955–1988, 2005):
|Σ computed − Σ| ≤ u|Σ| + γ²_k Σ|terms|, u = 2⁻⁵³, γ_k = ku/(1 − ku).

Products Mx are sliced (Ozaki, Ogita, Oishi and Rump, Numer. Algorithms 59:95–118, 2012): M = M₁ + M₂ + M₃,
x = x₁ + x₂ + x₃, where M₁, M₂, x₁ and x₂ have so few bits b that M₁x₁ and M₁x₂ + M₂x₁ are exact in any order
of summation: 2c products of 2b bits have a sum of at most 53 bits if 2(b − 1) + log₂ 2c ≤ 53, c the entries
of the longest row. The other products, M₁x₃, M₂(x₂ + x₃) and M₃x, are 2⁻²ᵇ times smaller; so is their
rounding: |fl(Pv) − Pv| ≤ γ_c |P||v| ≤ γ_c (Σ_j |P|_ij) max|v|.

A product that underflows is off by η = 2⁻¹⁰⁷⁴ at most; additions are exact there. What overflows ends as
infinity or NaN, which bounds nothing.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Matrix, Vector
from problems.stiffness import SAFE, U, gamma

ETA = 2.0**-1074  # the smallest positive number
TERMS = 5  # of a row of a residual, or fewer: two exact ones of each product, and one
MORE = 12  # roundings of what is not exact in a product beside those of its sums, or fewer
ENTRIES_AT_A_TIME = 2**15  # of M: they and what is computed from them stay in the processor's cache
WIDTH = 512  # columns of a dense M whose products are summed at once

#: (rows, columns, M[rows, columns]), dense or CSR; M is zero beside.
Panel = tuple[Any, slice, Any]


@dataclass(frozen=True)
class DoubleDouble:
    """hi + lo, |lo| at most about u|hi|."""

    hi: Matrix
    lo: Matrix

    def plus(self, correction: Matrix) -> "DoubleDouble":
        hi, error = two_sum(self.hi, correction)
        return DoubleDouble(*two_sum(hi, error + self.lo))

    def scaled(self, units: Vector) -> "DoubleDouble":
        """The sum times powers of two (n,), without rounding."""
        return DoubleDouble(units * self.hi, units * self.lo)

    def __getitem__(self, place: Any) -> "DoubleDouble":
        return DoubleDouble(self.hi[place], self.lo[place])


@dataclass(frozen=True)
class Enclosure:
    """Values and an entrywise bound on their errors."""

    value: Matrix
    error: Matrix

    def __getitem__(self, place: Any) -> "Enclosure":
        return Enclosure(self.value[place], self.error[place])


def two_sum(a: Matrix, b: Matrix) -> tuple[Matrix, Matrix]:
    """(s, e) with s = fl(a + b) and s + e = a + b exactly."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def exponent(size: Matrix | float) -> Any:
    """The least e with |size| < 2^e."""
    return np.frexp(size)[1].astype(float)


def cut(a: Matrix, top: Matrix | float, bits: int) -> tuple[Matrix, Matrix]:
    """a = piece + rest exactly, piece in units of 2^(top − bits + 1), for |a| ≤ 2^top."""
    sigma = 1.5 * np.exp2(top + 53 - bits)
    piece = a + sigma
    piece -= sigma
    return piece, a - piece


def length(v: Matrix) -> Any:
    """‖v‖₂ of each column, but for a relative rounding of nu; not finite if v is not.

    Squares of entries below 1e-162 would underflow: v is scaled by a power of two first.
    """
    scale = np.exp2(exponent(abs(v).max(axis=0, initial=0.0)))
    norm = np.linalg.norm(v / scale, axis=0)
    return scale * norm + ETA * (norm > 0)  # the product may be rounded to a multiple of η


class Residual:
    """value − Σ products, a column for each load case; exact terms are added with their rounding errors."""

    def __init__(self, value: Matrix, error: Matrix | None = None) -> None:
        self.hi, self.lo = np.array(value), np.zeros(value.shape)
        # A value in other units may be rounded to a multiple of η.
        self.error = ETA * (value != 0) if error is None else np.array(error)

    def subtract_product(
        self, panels: Iterable[Panel], longest: int, x: DoubleDouble, sharp: bool = True
    ) -> None:
        """Subtract Mx. x : (columns of M, k). panels : M in panels, no row with more than `longest` entries.

        sharp : if false, only M₁x₁ is exact; (M − M₁)x₁ and M(x − x₁), 2⁻ᵇ times smaller, are rounded.
        """
        bits = (53 - int(np.ceil(np.log2(2 * longest)))) // 2 + 1
        unit = _units(x.hi)  # M diag(unit) and x / unit have no rounding
        hi, lo = x.hi / unit[:, None], x.lo / unit[:, None]
        top = exponent(abs(hi).max(axis=0, initial=0.0))
        x1, after = cut(hi, top, bits)
        x2, x3 = cut(after, top - bits, bits)
        x3, after = x3 + lo, after + lo  # rounded by at most a rounding of themselves
        most, most3, most_after = (abs(part).max(axis=0, initial=0.0) for part in (hi, x3, after))
        # |M₁| ≤ |M| + 2ᵗ⁻ᵇ, |M₂| ≤ 2ᵗ⁻ᵇ, |M₃| ≤ 2ᵗ⁻²ᵇ, entry by entry, where there is one. M₃ by the second
        # half of x is left out: a rounding of M₃x. Σ|terms| ≤ |Σ| + 2 Σ|products|, where u|Σ| covers γ²|Σ|.
        again = 4 * gamma(TERMS) ** 2

        def of_each(rounding: float) -> Matrix:
            of_parts = rounding * most3 + again * most, rounding * most_after, rounding * most
            if not sharp:  # γ² is within the 1 % of γ 2⁻ᵇ
                of_parts = rounding * most_after, rounding * most, 0 * most
            return SAFE * np.stack([*of_parts, 8 * ETA * (1 + most) * (most > 0)])

        terms = min(longest, WIDTH + -(-longest // WIDTH))
        of_dense, of_sparse = of_each(gamma(terms + MORE)), of_each(gamma(longest + MORE))
        by_first, by_second, k = np.hstack([x1, x2, x3]), np.hstack([x1, after]), x1.shape[1]
        for rows, columns, panel in panels:
            entries, count, above, total, of_row = _scaled(panel, unit[columns])
            M1, beyond = cut(entries, of_row(above), bits)
            if sharp:
                M2, M3 = cut(beyond, of_row(above - bits), bits)
                first = _times(panel, M1, by_first[columns])
                small, rest = first[:, k : 2 * k], first[:, 2 * k :]
                if M2.any():
                    second = _times(panel, M2, by_second[columns])
                    small, rest = small + second[:, :k], rest + second[:, k:]
                if M3.any():
                    rest = rest + _times(panel, M3, hi[columns])
            else:
                first = _times(panel, M1, x1[columns])
                small = np.zeros_like(first)
                rest = _times(panel, entries, after[columns]) + _times(panel, beyond, x1[columns])
            value, lost = two_sum(self.hi[rows], -first[:, :k])
            self.hi[rows], error = two_sum(value, -small)
            self.lo[rows] += lost + (error - rest)
            of_M2 = count * np.exp2(above - bits)
            of_rows = np.hstack([total + of_M2, of_M2, of_M2 * 2.0**-bits, count + 1])
            self.error[rows] += of_rows @ (of_sparse if sp.issparse(panel) else of_dense)

    def subtract_small(self, panels: Iterable[Panel], longest: int, x: Matrix) -> None:
        """Subtract Mx, computed in float64, with its rounding error."""
        most = abs(x).max(axis=0, initial=0.0)
        of_each = SAFE * np.stack([gamma(longest + MORE) * most, ETA * (1 + most) * (most > 0)])
        for rows, columns, panel in panels:
            self.lo[rows] -= panel @ x[columns]
            self.error[rows] += np.column_stack([abs(panel).sum(axis=1), _count(panel) + 1]) @ of_each

    def enclosed(self) -> Enclosure:
        value = self.hi + self.lo
        return Enclosure(value, SAFE * (U * abs(value) + self.error))


def _units(x: Matrix) -> Vector:
    """Powers of two above the entries of each row; those of rows of zeros weigh no more than others."""
    size = abs(x).max(axis=1, initial=0.0)
    unit = np.exp2(exponent(size))
    return np.where(size > 0, unit, unit[size > 0].min(initial=1.0))


def row_panels(M: sp.csr_array) -> Iterator[Panel]:
    """Yields some rows of M at a time; rows without entries are left out."""
    filled = np.flatnonzero(np.diff(M.indptr))
    height = max(ENTRIES_AT_A_TIME * len(filled) // max(M.nnz, 1), 1)
    for start in range(0, len(filled), height):
        rows = filled[start : start + height]
        yield rows, slice(None), M[rows]


def _count(panel: Any) -> Vector:
    """Entries of each row."""
    return np.diff(panel.indptr) if sp.issparse(panel) else np.full(panel.shape[0], panel.shape[1])


def _scaled(panel: Any, unit: Vector) -> tuple[Matrix, Matrix, Matrix, Matrix, Callable[[Matrix], Matrix]]:
    """The entries of M diag(unit); for each row (r, 1) their number, the exponent of the largest, and the sum
    of their sizes; and a function that repeats figures of rows for their entries.
    """
    if not sp.issparse(panel):
        entries = panel * unit
        size = abs(entries)
        largest, total = size.max(axis=1, keepdims=True), size.sum(axis=1, keepdims=True)
        count = np.count_nonzero(entries, axis=1, keepdims=True)  # far fewer where a dense K has zeros
        return entries, count, exponent(largest), total, lambda of_row: of_row
    entries, count = panel.data * unit[panel.indices], np.diff(panel.indptr)
    size, largest = abs(entries), np.zeros(len(count))
    largest[count > 0] = np.maximum.reduceat(size, panel.indptr[:-1][count > 0]) if entries.size else 0
    figures = count[:, None], exponent(largest)[:, None], _with(panel, size).sum(axis=1)[:, None]
    return entries, *figures, lambda of_row: np.repeat(of_row[:, 0], count)


def _times(panel: Any, entries: Matrix, x: Matrix) -> Matrix:
    """The panel with other entries times x, WIDTH columns at a time if it is dense."""
    if sp.issparse(panel):
        return np.asarray(_with(panel, entries) @ x)
    total: Matrix = entries[:, :WIDTH] @ x[:WIDTH]
    for start in range(WIDTH, len(x), WIDTH):
        total += entries[:, start : start + WIDTH] @ x[start : start + WIDTH]
    return total


def _with(panel: Any, entries: Matrix) -> Any:
    """The panel with other entries."""
    if not sp.issparse(panel):
        return entries
    return sp.csr_array((entries, panel.indices, panel.indptr), shape=panel.shape)
