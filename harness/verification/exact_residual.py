"""Nearly exact residuals of the optimality conditions, each with a bound on its error.

    r = f − Kx − Aλ   (n,) N         s = g − Aᵀx   (m,) mm

x and λ are unevaluated sums hi + lo of two float64 vectors (double-double). Sums and products are error-free
transformations: two_sum and two_product return the rounding error beside the result (Knuth; Dekker), K is
cut into slices of so few bits that BLAS multiplies them exactly (Ozaki, Ogita, Oishi and Rump, Numer.
Algorithms 59:95–118, 2012), and the terms are added with their rounding errors (Ogita, Rump and Oishi, SIAM
J. Sci. Comput. 26:1955–1988, 2005): |Σ computed − Σ| ≤ u|Σ| + γ²_k Σ|terms|, u = 2⁻⁵³, γ_k = ku/(1 − ku).
Where they underflow, two_product is off by at most 5η, η = 2⁻¹⁰⁷⁴ (ibid.), and any other product by η/2;
additions are exact there. Both are counted. What overflows ends as infinity or NaN, which bounds nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Assembly, Matrix, Vector
from problems.stiffness.rounding import U as U
from problems.stiffness.rounding import gamma as gamma

ETA = 2.0**-1074  # the smallest positive number
SMALLEST_SCALE = 2.0**-960  # bounds are multiplied by no factor below it, lest they underflow to nothing
SPARSE_ROWS_AT_A_TIME = 4096
ROWS_AT_A_TIME = 16  # they and what is computed from them stay in the processor's cache
K_SLICES, X_SLICES = 2, 3


@dataclass(frozen=True)
class DoubleDouble:
    """hi + lo, |lo| at most about u|hi|."""

    hi: Vector
    lo: Vector

    def plus(self, correction: Vector) -> DoubleDouble:
        hi, error = two_sum(self.hi, correction)
        return DoubleDouble(*two_sum(hi, error + self.lo))


@dataclass(frozen=True)
class Enclosure:
    """A vector and an entrywise bound on its error."""

    value: Vector
    error: Vector


def two_sum(a: Vector, b: Vector) -> tuple[Vector, Vector]:
    """(s, e) with s = fl(a + b) and s + e = a + b exactly."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def two_product(a: Vector, b: Vector) -> tuple[Vector, Vector]:
    """(p, e) with p = fl(ab) and p + e = ab, exactly but for 5η where it underflows; no bound on overflow."""
    p = a * b
    (a1, a2), (b1, b2) = _halves(a), _halves(b)
    return p, a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2)


def _halves(a: Vector) -> tuple[Vector, Vector]:
    c = 134217729.0 * a  # 2²⁷ + 1
    hi = c - (c - a)
    return hi, a - hi


class ErrorFreeSum:
    """Adds terms with their rounding errors; `error` is the uncertainty of the terms themselves."""

    def __init__(self, shape: int | tuple[int, ...]) -> None:
        self.hi, self.lo = np.zeros(shape), np.zeros(shape)
        self.size, self.error = np.zeros(shape), np.zeros(shape)
        self.terms = 0

    def add(self, term: Vector, rows: slice = slice(None)) -> None:
        self.hi[rows], rounding = two_sum(self.hi[rows], term)
        self.lo[rows] += rounding
        self.size[rows] += abs(term)
        self.terms += 1

    def enclosed(self) -> Enclosure:
        value = self.hi + self.lo
        error = U * abs(value) + gamma(self.terms) ** 2 * self.size + ETA * (self.size > 0) + self.error
        return Enclosure(value, 1.01 * error)


def forces(assembly: Assembly, f: Vector, x: DoubleDouble, lam: DoubleDouble) -> Enclosure:
    """r = f − Kx − Aλ with its error bound, N."""
    total = ErrorFreeSum(assembly.n)
    total.add(f)
    subtract_sparse(total, slice(None), sp.csr_array(assembly.A), lam)
    for K, rows in zip(assembly.K.matrices, assembly.K.slices, strict=True):
        part = DoubleDouble(x.hi[rows], x.lo[rows])
        if sp.issparse(K):
            subtract_sparse(total, rows, sp.csr_array(K.T), part)  # symmetric, and stored by columns
        else:
            _subtract_dense(total, rows, K, part)
    return total.enclosed()


def gaps(assembly: Assembly, g: Matrix, x: DoubleDouble) -> Enclosure:
    """s = g − Aᵀx with its error bound, mm.

    g (m,) and x (n,), or a column for each load case.
    """
    total = ErrorFreeSum(g.shape)
    total.add(g)
    subtract_sparse(total, slice(None), sp.csr_array(assembly.A.T), x)
    return total.enclosed()


def subtract_sparse(total: ErrorFreeSum, rows: slice, A: sp.csr_array, v: DoubleDouble) -> None:
    """total[rows] −= Av, one entry of each of some rows at a time; the terms are counted row by row.

    v : a vector, or a column for each load case.
    """
    counts, first = np.diff(A.indptr), rows.start or 0
    parts = [part for part in (v.hi, v.lo) if part.any()]
    columns = (1,) * (v.hi.ndim - 1)
    terms, height = total.terms, max(SPARSE_ROWS_AT_A_TIME // max(v.hi[:1].size, 1), 1)
    for start in range(0, A.shape[0], height):
        chunk = slice(start, min(start + height, A.shape[0]))
        place, begin, count = slice(first + start, first + chunk.stop), A.indptr[:-1][chunk], counts[chunk]
        for k in range(int(count.max())):
            there = (count > k).reshape(-1, *columns)
            entry = np.where(count > k, begin + k, 0)
            data, indices = np.where(there, -A.data[entry].reshape(there.shape), 0.0), A.indices[entry]
            for part in parts:
                factor = np.where(there, part[indices], 0.0)
                term, rounding = two_product(data, factor)
                total.error[place] += 5 * ETA * (factor != 0)
                total.add(term, place)
                total.add(rounding, place)
    total.terms = terms + 2 * len(parts) * int(counts.max(initial=0))


def _subtract_dense(total: ErrorFreeSum, rows: slice, K: Matrix, x: DoubleDouble) -> None:
    """total[rows] −= Kx: the products of the slices of K and x.hi exactly, the remainder in float64.

    Slices of b bits give n products of 2b bits; their sum has at most 53 bits if 2(b − 1) + log₂ n ≤ 53,
    whatever the order of summation.
    """
    if not (x.hi.any() or x.lo.any()):
        return
    n = len(K)
    bits = (53 - int(np.ceil(np.log2(max(n, 2))))) // 2 + 1
    slices, rest = [], x.hi
    top = exponent(np.max(abs(x.hi), initial=0.0))
    for k in range(X_SLICES):
        piece, rest = cut(rest, top - k * bits, bits)
        slices.append(piece)
    exact, inexact = np.column_stack(slices), np.column_stack([rest, x.lo])
    left = float(abs(inexact).sum()) * (1 + 4 * n * U)
    length = float(abs(x.hi).sum()) * (1 + 2 * n * U)
    products, error = np.empty((K_SLICES * X_SLICES + 3, n)), np.empty(n)
    for start in range(0, n, ROWS_AT_A_TIME):
        chunk = slice(start, min(start + ROWS_AT_A_TIME, n))
        remainder = K.T[chunk]  # K is symmetric and stored by columns, so these are contiguous rows
        exponents = exponent(np.max(abs(remainder), axis=1, keepdims=True))
        products[:2, chunk] = (remainder @ inexact).T
        for k in range(K_SLICES):
            piece, remainder = cut(remainder, exponents - k * bits, bits)
            products[2 + k * X_SLICES : 2 + (k + 1) * X_SLICES, chunk] = (piece @ exact).T
        products[-1, chunk] = remainder @ x.hi
        scale = gamma(n) * np.maximum(np.exp2(exponents[:, 0]), SMALLEST_SCALE)
        error[chunk] = scale * (left + 2.0 ** (-K_SLICES * bits) * length + ETA) + len(products) * n * ETA
    for product in products:
        term = np.zeros(len(total.hi))
        term[rows] = -product
        total.add(term)
    total.error[rows] += 1.01 * error


def exponent(size: Matrix | float) -> Matrix:
    """The least e with |size| < 2^e."""
    return np.frexp(size)[1].astype(float)


def cut(a: Matrix, top: Matrix | float, bits: int) -> tuple[Matrix, Matrix]:
    """a = piece + rest exactly, piece in units of 2^(top − bits + 1), for |a| ≤ 2^top."""
    sigma = 1.5 * np.exp2(top + 53 - bits)
    piece = (a + sigma) - sigma
    return piece, a - piece
