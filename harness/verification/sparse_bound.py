"""A proven bound on the displacement error of an answer in the sparse form, by solutions with K alone.

From λ ≥ 0 with C = {λ > 0} the displacements x = K⁻¹(f − Aλ) are refined to twice the working precision, and
so is λ_C, until the gaps of C vanish. Then as in `batched.bound`, in balanced units D (powers of two), with
r = f − Kx − Aλ, s = g − Aᵀx, δ_i = −s_i for i in C and max(−s_i, 0) else,

    |x_i − x*_i| ≤ D_i/√κ ( ‖Dr‖₂/√κ + ‖δ‖₂ √(‖DKD‖_∞/σ²) ),      κ ≤ λmin(DKD),  σ² ≤ λmin(AᵀD²A):

the answer of the problem with f − r and g + δ is x, and from g to g + δ its feasible set is translated by a d
with ‖d‖_K ≤ ‖δ‖ √(‖DKD‖_∞/σ²).

A refinement step is λ_C ← λ_C − P y_C, P the inverse of Q_CC that M ≈ Q⁻¹ gives, and reduces y_C to about a
tenth. Forces that become negative are set to zero, overlapping contacts join C; the bound holds for any C.
Load cases are refined together, a column each, which share their solutions with K and are left out when done.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from problems.forms.assembly import Assembly, LoadCase, Matrix, Vector, stacked
from problems.forms.banded_inverse import BandedInverse, BandFactor
from problems.forms.prepared import Prepared
from problems.stiffness.operator import Stiffness

from .exact_residual import ETA, DoubleDouble, Enclosure, U, gamma, gaps
from .independence import independence
from .length import length
from .sliced_forces import SlicedForces

SAFE = 1.01  # for the rounding of the bounds themselves
MAX_STEPS = 30
MAX_SETS = 10  # tried with M in a step
MAX_WORSE = 3  # steps in a row that improve nothing
ENOUGH_MM = 1e-10  # a bound that needs no further step
PROVEN_ENOUGH_MM = 1e-9  # a wider one is tried to be improved by a factorisation for the contact set
ENTRIES_AT_A_TIME = 2**15  # of x: they and what is computed from them stay in the processor's cache


@dataclass(frozen=True)
class Proven:
    """x and λ as sums of two float64; max|x − x*| ≤ bound_mm over the displacements that are asked for."""

    x: DoubleDouble
    lam: DoubleDouble
    active: NDArray[np.bool_]
    bound_mm: float


@dataclass(frozen=True)
class SparseBound:
    """κ, ‖DKD‖_∞ and σ² of an assembly, its M, and for rounding |A| and |K|D (n, 1). D : (n, 1)."""

    prepared: Prepared
    M: BandedInverse
    A_size: sp.csc_array
    stiffness: Matrix
    D: Matrix
    kappa: float
    stiffest: float
    sigma2: float

    @classmethod
    def of(cls, prepared: Prepared, kappa: float) -> SparseBound | None:
        """kappa : κ. None where nothing can be proven so: no M, κ or σ²."""
        assembly, approximate = prepared.assembly, prepared.approximate_inverse
        if approximate is None or not kappa > 0:
            return None
        D = assembly.K.units[:, None]
        stiffness = assembly.K.absolute_sums(D[:, 0])[:, None]
        stiffest = SAFE * float((stiffness * D).max())
        sigma2 = independence(Assembly(Stiffness.of(), sp.csc_array(sp.diags_array(D[:, 0]) @ assembly.A)))
        if not sigma2 > 0:
            return None
        return cls(prepared, approximate.M, _size(assembly.A), stiffness, D, kappa, stiffest, sigma2)

    @np.errstate(over="ignore", invalid="ignore")
    def proven(
        self, loads: Sequence[LoadCase], lams: Sequence[Vector], xs: Sequence[Vector] | None = None
    ) -> list[Proven]:
        """From forces λ (m,) N of each load case, and about their displacements x (n,), if known."""
        lam = np.maximum(np.column_stack(lams), 0.0)
        state = _State(self, stacked(loads), lam, None if xs is None else np.column_stack(xs))
        C, cases = lam > 0, [_Progress() for _ in loads]
        left = cases  # those in the columns of the state
        for step in range(MAX_STEPS):
            C = (C & (state.lam.hi > 0)) | (state.s.value < -state.s.error)
            bounds = self._bound(state)
            halting = np.array([case.halting(bound) for case, bound in zip(left, bounds, strict=True)])
            if halting.any():
                state.renew(halting)  # what the steps have rounded may be what is left
                bounds = self._bound(state)
            for column, (case, bound) in enumerate(zip(left, bounds, strict=True)):
                if case.take(float(bound), last=step == MAX_STEPS - 1):
                    case.found = state.proven(column, float(bound))
            going = np.array([not case.done for case in left])
            if not going.any():
                break
            left, C, state = [case for case in left if not case.done], C[:, going], state.only(going)
            columns = zip(left, C.T, state.s.value.T, state.lam.hi.T, strict=True)
            state.move(np.column_stack([case.correction(self.M, *column) for case, *column in columns]))
        return [case.found for case in cases if case.found]

    def _bound(self, state: _State) -> Vector:
        """(k,) mm, of each column."""
        s, r, at_junction = state.s, state.r, self.prepared.assembly.at_junction
        pressing = state.lam.hi > 0
        delta = np.where(pressing, abs(s.value), np.maximum(-s.value, 0.0)) + s.error * (
            pressing | (s.value < s.error)
        )
        force = length(self.D * (abs(r.value) + r.error))
        distance = length(delta) * np.sqrt(self.stiffest / self.sigma2)
        error = SAFE * (force / np.sqrt(self.kappa) + distance) / np.sqrt(self.kappa)
        of_each = at_junction(self.D) * error + abs(at_junction(state.x.lo))
        bound = SAFE * of_each.max(axis=0, initial=0.0)
        return np.where(np.isfinite(bound) & ~(state.lam.hi < 0).any(axis=0), bound, np.inf)


@dataclass
class _Progress:
    """The smallest bound of a load case so far, mm. worse : steps in a row that improved nothing.

    factor : of M on the open contacts, which are the same ones in most steps.
    """

    least: float | None = None
    steps: int = 0
    worse: int = 0
    renewed: bool = False
    done: bool = False
    found: Proven | None = None
    factor: BandFactor | None = None

    def correction(self, M: BandedInverse, C: NDArray[np.bool_], y: Vector, lam: Vector) -> Vector:
        """dλ with λ + dλ ≥ 0 and Q_CC dλ ≈ −y_C − Q_CN dλ_N; λ_N, outside C, becomes zero.

        With t_N = M_NN⁻¹ ((M y_C)_N − λ_N) it is dλ_C = (M t − M y_C)_C. What it would make negative
        leaves C.
        """
        order = M.order
        C, lam = C[order], lam[order]
        for _ in range(MAX_SETS):
            v = M.product(np.where(C, y[order], 0.0))
            if self.factor is None or (self.factor.S == C).any():
                self.factor = None  # before the next one is made
                self.factor = M.factor(~C)
            t = self.factor.solve(np.where(C, 0.0, v - lam))
            change = M.product(t) - v
            negative = C & (lam + change < 0)
            if not negative.any():
                break
            C = C & ~negative
        dlam = np.empty_like(lam)
        dlam[order] = np.maximum(np.where(C, change, -lam), -lam)
        return dlam

    def halting(self, bound: float) -> bool:
        """Whether this bound is hardly better, for the first time. The first step corrects x more than λ."""
        first = self.steps > 1 and self.least is not None and not bound < self.least / 2 and not self.renewed
        self.renewed |= first
        return first

    def take(self, bound: float, last: bool) -> bool:
        """Whether the answer is to be kept: it proves enough and more than before, or is the last one."""
        better = self.least is None or bound < self.least
        self.least, self.steps = bound if better else self.least, self.steps + 1
        self.worse = 0 if better else self.worse + 1
        self.done = last or bound <= ENOUGH_MM or self.worse == MAX_WORSE
        if self.done:
            self.factor = None
        return (better and bound <= PROVEN_ENOUGH_MM) or (self.done and self.found is None)


class _State:
    """x (n, k) and λ (m, k) with enclosures of r = f − Kx − Aλ and s = g − Aᵀx."""

    def __init__(self, bound: SparseBound, loads: LoadCase, lam: Matrix, x: Matrix | None = None) -> None:
        self.bound, self.assembly, self.f, self.g = bound, bound.prepared.assembly, loads.f, loads.g
        self.forces = SlicedForces(self.assembly, bound.D)
        # The most terms in a row of Kx + Aλ; K is symmetric.
        self.depth = 4 + int(np.bincount(bound.A_size.indices, minlength=1).max())
        self.depth += max(int(np.diff(K.indptr).max(initial=0)) for K in self.assembly.K.matrices)
        self.lam = DoubleDouble(lam, np.zeros_like(lam))
        known = x is not None
        if x is None:
            x = bound.prepared.assembly.K.solve(self.f - self.assembly.A @ lam)
        self.x = DoubleDouble(x, np.zeros_like(x))
        self.r = self.forces(self.f, self.x, self.lam)
        if known:
            self.s: Enclosure = gaps(self.assembly, self.g, self.x)
        else:
            self.move(np.zeros_like(lam))

    def only(self, columns: NDArray[np.bool_]) -> _State:
        """The state of some load cases."""
        if columns.all():
            return self
        some = copy(self)
        some.f, some.g = self.f if self.f.shape[1] == 1 else self.f[:, columns], self.g[:, columns]
        some.x, some.lam = (DoubleDouble(v.hi[:, columns], v.lo[:, columns]) for v in (self.x, self.lam))
        some.r, some.s = (Enclosure(v.value[:, columns], v.error[:, columns]) for v in (self.r, self.s))
        return some

    def renew(self, columns: NDArray[np.bool_]) -> None:
        """r of some load cases from the original data, without the rounding of the steps."""
        some = self.only(columns)
        r = self.forces(some.f, some.x, some.lam)
        self.r.value[:, columns], self.r.error[:, columns] = r.value, r.error

    def move(self, dlam: Matrix) -> None:
        """To λ + dλ, and x with it."""
        # What is stored is λ + dλ but for the rounding of its second part, which counts below.
        self._move(self.bound.prepared.assembly.K.solve(self.r.value - self.assembly.A @ dlam), dlam)

    def _move(self, dx: Matrix, dlam: Matrix) -> None:
        """r − K dx − A dλ in float64: dx and dλ are small, and so is the rounding."""
        assembly, A, depth, D = self.assembly, self.assembly.A, self.depth, self.bound.D
        product, self.lam = assembly.K.multiply(dx), self.lam.plus(dlam)
        force, lam_size = A @ dlam, gamma(depth) * abs(dlam) + 2 * U * abs(self.lam.lo)
        of_force, most = self.bound.A_size @ lam_size, np.zeros(dx.shape[1])
        for rows in self._rows():
            x = DoubleDouble(self.x.hi[rows], self.x.lo[rows]).plus(dx[rows])
            self.x.hi[rows], self.x.lo[rows] = x.hi, x.lo
            x_size = gamma(depth) * abs(dx[rows]) + 2 * U * abs(x.lo)
            most = np.maximum(most, (x_size / D[rows]).max(axis=0))
        for rows in self._rows():
            value, error = self.r.value[rows], self.r.error[rows]
            # |K| x_size ≤ |K|D max(x_size / D)
            error += self.bound.stiffness[rows] * most + of_force[rows]
            error += gamma(depth) * abs(value) + depth * ETA
            error *= SAFE
            value -= product[rows]
            value -= force[rows]
        self.s = gaps(assembly, self.g, self.x)

    def _rows(self) -> Iterator[slice]:
        n, k = self.x.hi.shape
        height = max(ENTRIES_AT_A_TIME // k, 1)
        return (slice(start, start + height) for start in range(0, n, height))

    def proven(self, column: int, bound_mm: float) -> Proven:
        x, lam = (DoubleDouble(v.hi[:, column].copy(), v.lo[:, column].copy()) for v in (self.x, self.lam))
        return Proven(x, lam, lam.hi > 0, bound_mm)


def _size(M: sp.csc_array) -> sp.csc_array:
    """|M|, which shares its indices."""
    M = sp.csc_array(M)
    return sp.csc_array((abs(M.data), M.indices, M.indptr), shape=M.shape)
