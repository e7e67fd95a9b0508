"""A problem in units in which its unknowns and contacts weigh alike, and proven bounds on its matrices.

With D and R, powers of two, D_i √K_ii and R_j ‖DA_j‖₂ about 1,

    K' = DKD,  A' = DAR,  f' = Df,  g' = Rg,  x = Dx',  λ = Rλ':

the same problem without rounding, whatever the units of its unknowns and contacts were.

If a Cholesky factorisation of DKD − sI runs to completion, the smallest eigenvalue of DKD is at least s less
the backward error of that factorisation, whatever the factor of K (Rump, BIT 46:433–452, 2006; see
`Block.shifted`). A result below 2⁻¹⁰⁰⁰ counts as none: above it, the underflow in the factorisation, some n²η
with η = 2⁻¹⁰⁷⁴, is within the last 1 % of the margin.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector, stacked
from problems.forms.prepared import Prepared
from problems.stiffness import gamma
from problems.stiffness.block import Block, NotPositiveDefinite
from problems.stiffness.operator import Stiffness

from .enclosure import ETA, SAFE, DoubleDouble, Enclosure, Panel, Residual, exponent, length, row_panels

SHARES = (1.0, 0.2, 0.02)  # shares of the guess, tried in turn
SHARE, STEPS = 0.9, 20  # for AᵀA: share of an estimate from so many steps of the power method
SMALLEST = 2.0**-1000


@dataclass(frozen=True)
class Balanced:
    """An assembly in units D (n, 1) and R (m, 1); A (n, m) and its rows and columns are A'."""

    prepared: Prepared
    D: Matrix
    R: Matrix
    A: sp.csr_array
    At: sp.csr_array

    @classmethod
    def of(cls, prepared: Prepared) -> "Balanced":
        assembly = prepared.assembly
        D = assembly.K.units
        A = sp.csc_array(sp.diags_array(D) @ assembly.A)
        size = abs(A).max(axis=0).toarray().ravel() if A.shape[1] else np.zeros(0)
        R = np.exp2(-np.round(np.log2(np.where(size > 0, size, 1.0))))
        A = sp.csc_array(A @ sp.diags_array(R))
        return cls(prepared, D[:, None], R[:, None], sp.csr_array(A), sp.csr_array(A.T))

    @property
    def assembly(self) -> Assembly:
        return self.prepared.assembly

    def load(self, loads: Sequence[LoadCase]) -> LoadCase:
        """f' (n, k) or (n, 1), g' (m, k)."""
        both = stacked(loads)
        return LoadCase(_not_lost(self.D * both.f, both.f), _not_lost(self.R * both.g, both.g))

    def solve(self, b: Matrix) -> Matrix:
        """K'⁻¹b."""
        return self.assembly.K.solve(b / self.D) / self.D

    def residuals(
        self, load: LoadCase, x: DoubleDouble, lam: DoubleDouble, sharp: bool = True
    ) -> tuple[Enclosure, Enclosure]:
        """r = f' − K'x − A'λ (n, k) and s = g' − A'ᵀx (m, k). sharp : see `subtract_product`."""
        f = np.broadcast_to(load.f, x.hi.shape)
        total = Residual(np.concatenate([f, load.g]))
        total.subtract_product(row_panels(self.A), _longest(self.A), lam)
        total.subtract_product(self._panels(), self._longest, x, sharp)
        return self._parts(total)

    def moved(self, r: Enclosure, s: Enclosure, dx: Matrix, dlam: Matrix) -> tuple[Enclosure, Enclosure]:
        """r − K'dx − A'dλ and s − A'ᵀdx, for small dx (n, k) and dλ (m, k)."""
        total = Residual(np.concatenate([r.value, s.value]), np.concatenate([r.error, s.error]))
        total.subtract_small(row_panels(self.A), _longest(self.A), dlam)
        total.subtract_small(self._panels(), self._longest, dx)
        return self._parts(total)

    def _parts(self, total: Residual) -> tuple[Enclosure, Enclosure]:
        both, n = total.enclosed(), len(self.D)
        return both[:n], both[n:]

    @cached_property
    def stiffest(self) -> float:
        """‖K'‖_∞ or more."""
        D = self.D[:, 0]
        return SAFE * float((self.assembly.K.absolute_sums(D) * D).max(initial=0.0))

    def energy_norm(self, z: Matrix) -> Vector:
        """‖z‖_K' (k,) or more, for z (n, k).

        |fl(zᵀK'z) − zᵀK'z| ≤ γ_2n |z|ᵀ|K'||z| ≤ γ_2n ‖K'‖_∞ ‖z‖².
        """
        scale = np.exp2(exponent(abs(z).max(axis=0, initial=0.0)))
        w = z / scale  # whose squares do not underflow
        square = np.maximum((w * (self.D * self.assembly.K.multiply(self.D * w))).sum(axis=0), 0.0)
        square += gamma(2 * len(z)) * self.stiffest * length(w) ** 2
        return SAFE * scale * np.sqrt(square)

    @cached_property
    def sigma2(self) -> float:
        """σ² ≤ λmin(A'ᵀA'), proven; 0 if the contacts are dependent."""
        return independence(sp.csc_array(self.A))

    @cached_property
    def _longest(self) -> int:
        return max(map(_longest, (*self.assembly.K.matrices, self.At)))

    def _panels(self) -> Iterator[Panel]:
        """Rows of K', and of A'ᵀ below it."""
        D = self.D[:, 0]
        for rows, columns, panel in row_panels(self.At):
            yield rows + len(D), columns, panel
        for rows, columns, panel in self.assembly.K.panels():
            if sp.issparse(panel):
                data = panel.data * D[columns][panel.indices] * np.repeat(D[rows], np.diff(panel.indptr))
                yield rows, columns, sp.csr_array((data, panel.indices, panel.indptr), shape=panel.shape)
            else:
                entries = panel * D[columns]
                entries *= D[rows, None]
                yield rows, columns, entries


def _not_lost(scaled: Matrix, value: Matrix) -> Matrix:
    """Values in other units; one that would underflow to zero is ±η, within the error of a `Residual`."""
    lost = (scaled == 0) & (value != 0)
    return np.where(lost, np.copysign(ETA, value), scaled) if lost.any() else scaled


def _longest(M: Any) -> int:
    """The most entries in a row of a symmetric or CSR matrix."""
    return int(np.diff(M.indptr).max(initial=1)) if sp.issparse(M) else int(M.shape[1])


def smallest_eigenvalue(K: Stiffness, D: Vector, guesses: Sequence[float]) -> float:
    """κ ≤ λmin(DKD), proven; 0 if no positive one was found.

    D (n,) : powers of two. guesses : of a κ for each block; the closer from below, the sharper the bound.
    """
    blocks = zip(K.blocks, K.slices, guesses, strict=True)
    return min((_of_block(block, D[rows], guess) for block, rows, guess in blocks), default=np.inf)


def independence(A: sp.csc_array) -> float:
    """A proven σ² ≤ λmin(AᵀA), how independent the contacts are; 0 if none was found.

    The entries of AᵀA are rounded by γ_c (|A|ᵀ|A|), c the longest column.
    """
    if A.shape[1] == 0:
        return np.inf
    G, size, ones = Stiffness.of(sp.csc_array(A.T @ A)), abs(A), np.ones(A.shape[1])
    try:
        least = smallest_eigenvalue(G, ones, [SHARE * about for about in G.least_eigenvalues(ones, STEPS)])
    except NotPositiveDefinite:
        return 0.0
    longest = int(np.diff(sp.csc_array(A).indptr).max())
    sigma2 = least - SAFE * gamma(longest + 1) * float((size.T @ (size @ ones)).max())
    return sigma2 if sigma2 >= SMALLEST else 0.0


def _of_block(block: Block, D: Vector, guess: float) -> float:
    for s in (share * guess for share in SHARES):
        away = block.shifted(D, s)
        if away is not None and s - SAFE * away >= SMALLEST:
            return float(s - SAFE * away)
    return 0.0
