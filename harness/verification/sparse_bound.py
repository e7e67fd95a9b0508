"""A proven bound on the displacement error of an answer in the sparse form, by solutions with K alone.

From λ ≥ 0 with C = {λ > 0} the displacements x = K⁻¹(f − Aλ) are refined to twice the working precision, and
so is λ_C, until the gaps of C vanish. Then as in `batched.bound`, in balanced units D (powers of two), with
r = f − Kx − Aλ, s = g − Aᵀx, δ_i = −s_i for i in C and max(−s_i, 0) else,

    |x_i − x*_i| ≤ D_i/√κ ( ‖Dr‖₂/√κ + ‖δ‖₂ √(‖DKD‖_∞/σ²) ),      κ ≤ λmin(DKD),  σ² ≤ λmin(AᵀD²A):

the answer of the problem with f − r and g + δ is x, and from g to g + δ its feasible set is translated by a d
with ‖d‖_K ≤ ‖δ‖ √(‖DKD‖_∞/σ²).

A refinement step is λ_C ← λ_C − P y_C, P the inverse of Q_CC that M ≈ Q⁻¹ gives, and reduces y_C to about a
tenth. Forces that become negative are set to zero, overlapping contacts join C; the bound holds for any C.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.balance import balanced_units
from problems.forms.banded_inverse import BandedInverse
from problems.forms.sparse_prepared import SparsePrepared

from .exact_residual import ETA, DoubleDouble, Enclosure, U, forces, gamma, gaps
from .independence import independence
from .length import length

SAFE = 1.01  # for the rounding of the bounds themselves
MAX_STEPS = 30
MAX_SETS = 10  # tried with M in a step
MAX_WORSE = 3  # steps in a row that improve nothing
ENOUGH_MM = 1e-10  # a bound that needs no further step


@dataclass(frozen=True)
class Proven:
    """x and λ as sums of two float64; max|x − x*| ≤ bound_mm over the displacements that are asked for."""

    x: DoubleDouble
    lam: DoubleDouble
    active: NDArray[np.bool_]
    bound_mm: float


@dataclass(frozen=True)
class SparseBound:
    """κ, ‖DKD‖_∞, σ² of an assembly, its M, and |K|, |A| for the rounding of products with them."""

    prepared: SparsePrepared
    M: BandedInverse
    sizes: tuple[sp.csc_array, ...]
    A_size: sp.csc_array
    D: Vector
    kappa: float
    stiffest: float
    sigma2: float

    @classmethod
    def of(cls, prepared: SparsePrepared, kappa: float) -> SparseBound | None:
        """kappa : κ. None where nothing can be proven so: no M, κ or σ², or numbers altered on reading."""
        assembly, approximate = prepared.assembly, prepared.approximate_inverse
        if approximate is None or assembly.altered or not kappa > 0:
            return None
        D = balanced_units(assembly)
        sizes, A_size = tuple(map(_size, assembly.blocks)), _size(assembly.A)
        rows = zip(sizes, assembly.slices, strict=True)
        stiffest = SAFE * max(float((K @ D[s] * D[s]).max()) for K, s in rows)
        sigma2 = independence(Assembly((), sp.csc_array(sp.diags_array(D) @ assembly.A)))
        if not sigma2 > 0:
            return None
        return cls(prepared, approximate.M, sizes, A_size, D, kappa, stiffest, sigma2)

    @np.errstate(over="ignore", invalid="ignore")
    def proven(self, load: LoadCase, lam: Vector) -> Proven:
        """From forces λ (m,) N."""
        lam = np.maximum(lam, 0.0)
        state = _State(self, load, lam)
        C, best, worse, renewed = lam > 0, None, 0, False
        for _ in range(MAX_STEPS):
            y = state.s.value
            C = (C & (state.lam.hi > 0)) | (y < -state.s.error)
            bound = self._bound(state, C)
            if best is not None and not bound < best.bound_mm / 2 and not renewed:
                state.renew()  # what the steps have rounded may be what is left
                bound, renewed = self._bound(state, C), True
            worse = 0 if best is None or bound < best.bound_mm else worse + 1
            if not worse:
                best = Proven(state.x, state.lam, state.lam.hi > 0, bound)
            if bound <= ENOUGH_MM or worse == MAX_WORSE:
                break
            state.move(_correction(self.M, C, y, state.lam.hi))
        assert best is not None
        return best

    def _bound(self, state: _State, C: NDArray[np.bool_]) -> float:
        s, r = state.s, state.r
        pressing = state.lam.hi > 0
        if (state.lam.hi < 0).any():
            return np.inf
        delta = np.where(pressing, abs(s.value), np.maximum(-s.value, 0.0)) + s.error * (
            pressing | (s.value < s.error)
        )
        force = float(length(self.D * (abs(r.value) + r.error)))
        distance = float(length(delta)) * np.sqrt(self.stiffest / self.sigma2)
        error = SAFE * (force / np.sqrt(self.kappa) + distance) / np.sqrt(self.kappa)
        of_each = self.prepared.assembly.at_junction(self.D * error + abs(state.x.lo))
        bound = SAFE * float(of_each.max(initial=0.0))
        return bound if np.isfinite(bound) else np.inf


class _State:
    """x and λ with enclosures of r = f − Kx − Aλ and s = g − Aᵀx."""

    def __init__(self, bound: SparseBound, load: LoadCase, lam: Vector) -> None:
        prepared, self.sizes, self.A_size = bound.prepared, bound.sizes, bound.A_size
        self.prepared, self.load = prepared, load
        # The most terms in a row of Kx + Aλ; K is symmetric.
        self.depth = 4 + int(np.bincount(self.A_size.indices, minlength=1).max())
        self.depth += max(int(np.diff(K.indptr).max(initial=0)) for K in self.sizes)
        self.lam = DoubleDouble(lam, np.zeros_like(lam))
        x = prepared.solve_K(load.f - prepared.assembly.A @ lam)
        self.x = DoubleDouble(x, np.zeros_like(x))
        self.r = forces(prepared.assembly, load.f, self.x, self.lam)
        self._move(prepared.solve_K(self.r.value), np.zeros_like(lam))

    def move(self, dlam: Vector) -> None:
        """To λ + dλ, and x with it."""
        # What is stored is λ + dλ but for the rounding of its second part, which counts below.
        self._move(self.prepared.solve_K(self.r.value - self.prepared.assembly.A @ dlam), dlam)

    def renew(self) -> None:
        """r from the original data, without the rounding of the steps."""
        self.r = forces(self.prepared.assembly, self.load.f, self.x, self.lam)

    def _move(self, dx: Vector, dlam: Vector) -> None:
        """r − K dx − A dλ in float64: dx and dλ are small, and so is the rounding."""
        assembly, depth = self.prepared.assembly, self.depth
        self.x, self.lam = self.x.plus(dx), self.lam.plus(dlam)
        x_size = gamma(depth) * abs(dx) + 2 * U * abs(self.x.lo)
        lam_size = gamma(depth) * abs(dlam) + 2 * U * abs(self.lam.lo)
        slices = zip(self.sizes, assembly.slices, strict=True)
        rounding = np.concatenate([K @ x_size[rows] for K, rows in slices]) + self.A_size @ lam_size
        value = self.r.value - assembly.multiply_K(dx) - assembly.A @ dlam
        error = self.r.error + rounding + gamma(depth) * abs(self.r.value) + depth * ETA
        self.r = Enclosure(value, SAFE * error)
        self.s: Enclosure = gaps(assembly, self.load.g, self.x)


def _size(M: sp.csc_array) -> sp.csc_array:
    """|M|, which shares its indices."""
    M = sp.csc_array(M)
    return sp.csc_array((abs(M.data), M.indices, M.indptr), shape=M.shape)


def _correction(M: BandedInverse, C: NDArray[np.bool_], y: Vector, lam: Vector) -> Vector:
    """dλ with λ + dλ ≥ 0, zero outside C, and Q_CC dλ ≈ −y_C − Q_CN dλ_N; λ_N, of the others, becomes zero.

    With t_N = M_NN⁻¹ ((M y_C)_N − λ_N) it is dλ_C = (M t − M y_C)_C. What it would make negative leaves C.
    """
    order = M.order
    C, lam = C[order], lam[order]
    for _ in range(MAX_SETS):
        v = M.product(np.where(C, y[order], 0.0))
        t = M.factor(~C).solve(np.where(C, 0.0, v - lam))
        change = M.product(t) - v
        negative = C & (lam + change < 0)
        if not negative.any():
            break
        C = C & ~negative
    dlam = np.empty_like(lam)
    dlam[order] = np.maximum(np.where(C, change, -lam), -lam)
    return dlam
