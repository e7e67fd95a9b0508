"""r = f − Kx − Aλ of a sparse K for several load cases at once, nearly exact, by products of slices.

In balanced units, which have K's digits (see problems.forms.balance), K = K₁ + K₂ + K₃ and x = x₁ + x₂ + x₃,
x₃ with the second half of x, where K₁, K₂, x₁ and x₂ have so few bits that K₁x₁, K₁x₂ and K₂x₁ are exact in
any order of summation (see `exact_residual`). The other products, K₁x₃, K₂(x₂ + x₃) and K₃x, are 2⁻²ᵇ times
smaller, b ≈ 24, and so is their rounding: |fl(Pv) − Pv| ≤ γ_c |P||v| ≤ γ_c (Σ_j |P|_ij) max|v|, c the longest
row. Each is one pass over K for all load cases.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Assembly, Matrix

from .exact_residual import (
    ETA,
    DoubleDouble,
    Enclosure,
    ErrorFreeSum,
    cut,
    exponent,
    gamma,
    subtract_sparse,
)

SAFE = 1.01  # for the rounding of the bounds themselves
ROWS_AT_A_TIME = 4096
BYTES_AT_A_TIME = 2**24  # of x: its slices take several times as much


@dataclass(frozen=True)
class SlicedForces:
    """The residual of an assembly with sparse blocks, symmetric. D : (n, 1) balanced units."""

    assembly: Assembly
    D: Matrix

    def __call__(self, f: Matrix, x: DoubleDouble, lam: DoubleDouble) -> Enclosure:
        """f (n, k) or (n, 1), x (n, k), λ (m, k)."""
        value, error = np.empty_like(x.hi), np.empty_like(x.hi)
        at_a_time = max(BYTES_AT_A_TIME // (8 * len(x.hi)), 1)
        for start in range(0, x.hi.shape[1], at_a_time):
            some = (slice(None), slice(start, start + at_a_time))
            own_f = f if f.shape[1] == 1 else f[some]
            found = self._some(own_f, *(DoubleDouble(v.hi[some], v.lo[some]) for v in (x, lam)))
            value[some], error[some] = found.value, found.error
        return Enclosure(value, error)

    def _some(self, f: Matrix, x: DoubleDouble, lam: DoubleDouble) -> Enclosure:
        total = ErrorFreeSum(x.hi.shape)
        total.add(np.broadcast_to(f, x.hi.shape))
        subtract_sparse(total, slice(None), sp.csr_array(self.assembly.A), lam)
        for K, rows in zip(self.assembly.K.matrices, self.assembly.K.slices, strict=True):
            D = self.D[rows]
            _subtract(total, rows, K, D, DoubleDouble(x.hi[rows] / D, x.lo[rows] / D))
        return total.enclosed()


def _subtract(total: ErrorFreeSum, rows: slice, K: sp.csc_array, D: Matrix, x: DoubleDouble) -> None:
    """total[rows] −= D⁻¹(DKD)x, some rows at a time."""
    counts = np.diff(K.indptr)
    longest = int(counts.max(initial=1))
    bits = (53 - int(np.ceil(np.log2(max(longest, 2))))) // 2 + 1
    top = exponent(abs(x.hi).max(axis=0))
    x1, after = cut(x.hi, top, bits)
    x2, x3 = cut(after, top - bits, bits)
    # The second halves are added in float64, at most a rounding of x₃ or of x₂ + x₃.
    x3, after = x3 + x.lo, after + x.lo
    most, most3, most_after, most_lo = (abs(part).max(axis=0) for part in (x.hi, x3, after, x.lo))
    first, second = np.hstack([x1, x2, x3]), np.hstack([x1, after])
    above = float(exponent(float((K.diagonal() * D[:, 0] ** 2).max(initial=0.0))))  # of |DKD|, K ≻ 0
    for start in range(0, K.shape[0], ROWS_AT_A_TIME):
        stop = min(start + ROWS_AT_A_TIME, K.shape[0])
        begin, end, count = K.indptr[start], K.indptr[stop], counts[start:stop]
        # K is symmetric, so that its columns are its rows.
        data = K.data[begin:end] * D[K.indices[begin:end], 0] * np.repeat(D[start:stop, 0], count)
        K1, rest = cut(data, above, bits)
        K2, K3 = cut(rest, above - bits, bits)
        part = sp.csr_array(
            (K1, K.indices[begin:end], K.indptr[start : stop + 1] - begin), shape=(stop - start, K.shape[0])
        )
        terms = np.split(part @ first, 3, axis=1)
        part.data = K2
        terms += np.split(part @ second, 2, axis=1)
        part.data = K3
        terms.append(part @ x.hi)
        part.data = abs(data)
        place, unit = slice(rows.start + start, rows.start + stop), D[start:stop]
        for term in terms:
            total.add(-term / unit, place)
        # |K₁| ≤ |DKD| + 2ᵃ⁻ᵇ, |K₂| ≤ 2ᵃ⁻ᵇ, |K₃| ≤ 2ᵃ⁻²ᵇ, entry by entry, where there is one
        of_K2 = count[:, None] * 2.0 ** (above - bits)
        of_K1, of_K3 = (part @ np.ones(K.shape[0]))[:, None] + of_K2, of_K2 * 2.0**-bits
        rounding = gamma(longest + 4) * (of_K1 * most3 + of_K2 * most_after + of_K3 * most)
        # K₃ by the second half of x is left out.
        error = rounding + of_K3 * most_lo + 8 * (longest + 1) * ETA
        total.error[place] += SAFE * error / unit + 8 * ETA
