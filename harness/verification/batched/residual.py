"""r = f − Kx − Aλ of a block of load cases, one column each, by one pass over K, with an error bound.

K and x are split in two, K = K₁ + K₂ and x = x₁ + x₂ with so few bits in K₁ and x₁ that BLAS multiplies them
exactly (see `exact_residual`). K₂ and x₂ are 2⁻ᵇ times smaller, b ≈ 20, and so are the rounding errors of
their products, in any order of summation: |fl(K₂x₁) − K₂x₁| ≤ γ_n |K₂||x₁| ≤ γ_n (Σ_j |K₂|_ij) max|x₁|;
likewise for Kx₂.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from harness.verification.exact_residual import ETA, ROWS_AT_A_TIME, SMALLEST_SCALE, cut, exponent, gamma
from problems.forms.assembly import Assembly, Matrix

SAFE = 1.01  # for the rounding of the bounds themselves


@dataclass(frozen=True)
class Split:
    """x = head + tail exactly, (n, k), the head of so few bits that its products with K₁ are exact."""

    head: Matrix
    tail: Matrix

    @property
    def rounded(self) -> Matrix:
        return self.head + self.tail

    def plus(self, correction: Matrix) -> Split:
        """Another point, x + correction but for the rounding of the tail."""
        return Split(self.head, self.tail + correction)


def bits(n: int) -> int:
    """b with n products of two b-bit numbers summing up to at most 53 bits: 2(b − 1) + log₂ n ≤ 53."""
    return (53 - int(np.ceil(np.log2(max(n, 2))))) // 2 + 1


def split(assembly: Assembly, x: Matrix) -> Split:
    """x (n, k) split, block by block of K."""
    head = np.empty_like(x)
    for K, rows in zip(assembly.K.matrices, assembly.K.slices, strict=True):
        head[rows] = cut(x[rows], exponent(abs(x[rows]).max(axis=0)), bits(len(K)))[0]
    return Split(head, x - head)


def residual(assembly: Assembly, f: Matrix, x: Split, lam: Matrix) -> tuple[Matrix, Matrix]:
    """(r, e), (n, k) N each, with |r − (f − Kx − Aλ)| ≤ e. f (n, k), λ (m, k)."""
    A = assembly.A.tocsr()
    r, size = f - A @ lam, abs(f) + abs(A) @ abs(lam)
    error = np.empty_like(r)
    for K, rows in zip(assembly.K.matrices, assembly.K.slices, strict=True):
        products, error[rows] = _products(K, x.head[rows], x.tail[rows])
        for product in products:
            r[rows] -= product
            size[rows] += abs(product)
    depth = int(np.diff(A.indptr).max(initial=0)) + 5
    error += gamma(depth) * size + depth * ETA
    return r, SAFE * error


def refined(
    assembly: Assembly, x: Split, r: Matrix, error: Matrix, d: Matrix, stiffest: float
) -> tuple[Split, Matrix, Matrix]:
    """x + d, and its residual r − Kd with a bound on its error. stiffest ≥ ‖K‖_∞, N/mm.

    d is small, so a plain product suffices: |fl(Kd) − Kd| ≤ γ_n ‖K‖_∞ max|d|.
    """
    moved, n = x.plus(d), assembly.n
    Kd = assembly.K.multiply(d)
    error_of_d = gamma(n) * abs(d).max(axis=0) + gamma(1) * abs(moved.tail).max(axis=0) + ETA
    error = error + stiffest * error_of_d + gamma(1) * (abs(r) + abs(Kd)) + (n + 1) * ETA
    return moved, r - Kd, SAFE * error


def _products(K: Matrix, head: Matrix, tail: Matrix) -> tuple[list[Matrix], Matrix]:
    """K₁x₁, K₂x₁ and Kx₂, and a bound on the sum of their errors."""
    n, b = len(K), bits(len(K))
    products = [np.empty_like(head) for _ in range(3)]
    rounding = np.empty_like(head)
    head_size, tail_size = abs(head).max(axis=0), abs(tail).max(axis=0)
    for start in range(0, n, ROWS_AT_A_TIME):
        chunk = slice(start, min(start + ROWS_AT_A_TIME, n))
        whole = K.T[chunk]  # K is symmetric and stored by columns, so these are contiguous rows
        top = exponent(np.max(abs(whole), axis=1, keepdims=True))
        K1, K2 = cut(whole, top, b)
        for product, left, right in zip(products, (K1, K2, whole), (head, head, tail), strict=True):
            product[chunk] = left @ right
        sums = [abs(each).sum(axis=1, keepdims=True) for each in (K2, whole)]
        scaled = [gamma(n) * np.maximum(each, SMALLEST_SCALE) for each in sums]
        rounding[chunk] = SAFE * (scaled[0] * head_size + scaled[1] * tail_size + 4 * n * ETA)
    return products, rounding
