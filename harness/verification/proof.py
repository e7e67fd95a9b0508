"""A proven bound on the displacement error of an answer, from K, A, f, g and forces λ alone.

Any x and λ ≥ 0, with C = {λ > 0}, are the exact answer of another problem, f̃ = f − r and g̃ = g + δ, where

    r = f − Kx − Aλ,    s = g − Aᵀx,    δ_i = −s_i for i in C,    δ_i = max(−s_i, 0) else.

The answer is P(K⁻¹f), P the projection onto {Aᵀx ≤ g} in the norm of K. From f to f̃ it moves by at most
‖r‖_{K⁻¹}. From g to g̃ the set is translated by d = A(AᵀA)⁻¹δ, and P then moves by d/2 and at most ‖d‖_K/2,
as I − P is firmly nonexpansive. So, in balanced units (balanced_units.py), κ ≤ λmin(K) and σ² ≤ λmin(AᵀA),

    |x_i − x*_i| ≤ D_i/√κ ( ‖r‖₂/√κ + ‖δ‖₂ √(‖K‖_∞/σ²) ).                                     (plain)

The factor D_i/√κ may be replaced by √(K⁻¹)_ii (compliant). Any other d bounds the second term too if x and
λ are exact for the gap g + Aᵀd: d = z + A(AᵀA)⁻¹δ', δ' the δ of s + Aᵀz, is short for z = K⁻¹AMδ, M ≈ Q⁻¹,
or z = K⁻¹A_C Q_CC⁻¹δ_C. This costs one solution with K and saves the refinement of many load cases:

    |x_i − x*_i| ≤ |z_i|/2 + √(K⁻¹)_ii ( ‖r‖₂/√κ + ‖z‖_K/2 + ‖δ'‖₂ √(‖K‖_∞/σ²) ).              (translated)

Nothing is assumed about the contact set: weakly active contacts need no special treatment, and it does not
matter where λ came from. Refinement of x and λ_C in twice the working precision makes the bound small:

    x ← x + K⁻¹r,        Q_CC dλ = −y_C,        λ ← max(λ + dλ, 0),        x ← x − K⁻¹A dλ,

by conjugate gradients with products Q_CC v = A_Cᵀ K⁻¹ A_C v, preconditioned by M (closed_contacts.py), or
with springs at the contacts of C where there is neither M nor Q, or K is small and dense and σ² = 0
(sprung_contacts.py). Load cases are columns; a column is taken out when its bound is small enough.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from pathlib import Path

import numpy as np

from problems import storage
from problems.forms.assembly import LoadCase, Mask, Matrix, Vector
from problems.forms.prepared import Prepared
from problems.stiffness import gamma
from problems.storage import fingerprint

from .balanced_units import Balanced
from .closed_contacts import ClosedContacts, ScaledInverse
from .enclosure import ETA, SAFE, DoubleDouble, Enclosure, length
from .feasible_push import Push, nearly_closed
from .sprung_contacts import SprungContacts, SprungFactors

MAX_PASSES = 30
MAX_WORSE = 3  # passes in a row that do not halve the bound of the last: contact sets may still change
MAX_PRODUCTS = 60  # of conjugate gradients in a pass
REDUCTION = 1e-6  # of y_C in a pass
FLAT = 2.0**-20  # of 1/ρ: a curvature of dependent contacts
FEW = 2000  # unknowns of a dense K that is factored with springs
AT_ROUNDING = 1.5  # of what roundings alone give: a bound that no further pass halves


@dataclass(frozen=True)
class Proven:
    """x (n,) and λ (m,) as sums of two float64; max|x.hi − x*| ≤ bound_mm over the displacements asked for.

    bound_mm is infinite, never NaN, where nothing can be proven.
    """

    x: DoubleDouble
    lam: DoubleDouble
    bound_mm: float

    @property
    def active(self) -> Mask:
        return self.lam.hi > 0


class Sharpness(Enum):
    """The bounds of this file; each but the first costs more than the one before."""

    PLAIN = "plain"
    COMPLIANT = "compliant"
    TRANSLATED = "translated"


class Proof:
    """Bounds the displacement error of answers on one assembly.

    kappa : κ ≤ λmin(DKD), in balanced units.
    """

    def __init__(self, prepared: Prepared, kappa: float) -> None:
        self.balanced, self.kappa = Balanced.of(prepared), kappa

    @cached_property
    def inverse(self) -> ScaledInverse:
        """M ≈ Q⁻¹, made when an answer is first refined."""
        return ScaledInverse.of(self.balanced.prepared, self.balanced.R[:, 0])

    @cached_property
    def springs(self) -> SprungFactors | None:
        """K with springs, where K is sparse and there is neither M nor Q, or it is dense and small and the
        contacts are almost dependent.
        """
        inverse, assembly = self.inverse, self.balanced.assembly
        sprung = inverse.M is None and inverse.Q is None
        if assembly.K.dense:
            sprung = assembly.n <= FEW and self.balanced.sigma2 == 0
        return SprungFactors(self.balanced, self.kappa) if sprung else None

    @property
    def pushes(self) -> bool:
        """Whether contacts depend on one another, so that a push bounds what is missed."""
        return self.balanced.sigma2 == 0 and self.springs is not None

    @cached_property
    def compliance(self) -> float:
        """max (K⁻¹)_ii or more, mm/N; infinite without M and Q, or where no bound is cheap."""
        if self.inverse.M is None and self.inverse.Q is None:
            return np.inf
        return cached_figure(self.balanced.prepared, "compliance", self._largest_compliance)

    def _largest_compliance(self) -> float:
        K, D = self.balanced.assembly.K, self.balanced.D[:, 0]
        pairs = zip(K.blocks, K.slices, strict=True)
        return max(block.largest_compliance(D[rows], self.kappa) for block, rows in pairs)

    @cached_property
    def spread(self) -> float:
        """max|x − x*| / ‖δ‖₂ at most, mm; compliant, for where a bound suffices."""
        units = self.balanced
        reach = float(units.assembly.at_junction(units.D).max(initial=0.0)) / np.sqrt(self.kappa)
        stretch = np.sqrt(np.divide(units.stiffest, units.sigma2))
        return float(min(reach, np.sqrt(self.compliance)) * stretch) or 1.0

    @np.errstate(over="ignore", invalid="ignore", divide="ignore")
    def proven(
        self,
        loads: Sequence[LoadCase],
        lams: Sequence[Vector],
        xs: Iterable[Vector] | None = None,
        enough_mm: float = 0.0,
    ) -> list[Proven]:
        """A refined answer with its bound for each load case.

        lams : forces (m,) N. xs : about their displacements (n,) mm, computed by default. enough_mm : a bound
        that needs no further pass, as does none that is about what the roundings of x, r and s give.
        """
        units, load = self.balanced, self.balanced.load(loads)
        load = LoadCase(np.broadcast_to(load.f, (len(units.D), len(loads))), load.g)
        lam = np.maximum(np.column_stack(lams), 0.0) / units.R
        x = units.solve(load.f - units.A @ lam) if xs is None else np.column_stack(list(xs)) / units.D
        x2, lam2 = DoubleDouble(x, np.zeros_like(x)), DoubleDouble(lam, np.zeros_like(lam))
        quick = enough_mm > 0 and np.isfinite(self.compliance)
        sharpness = Sharpness.COMPLIANT if quick else Sharpness.PLAIN
        r, s = units.residuals(load, x2, lam2, sharp=not quick)
        best = [Proven(x2[:, k], lam2[:, k], np.inf) for k in range(len(loads))]
        worse, last = np.zeros(len(loads), dtype=int), np.full(len(loads), np.inf)
        cases = np.arange(len(loads))  # the load case of each column
        bounds, _ = self.bounds(x2, lam2, r, s, Sharpness.TRANSLATED if quick else sharpness)
        rounding = np.zeros(len(loads))  # the first pass is always worth it
        for step in range(MAX_PASSES):
            enough = np.maximum(enough_mm, AT_ROUNDING * rounding)
            going = np.zeros(len(cases), dtype=bool)
            for column, k in enumerate(cases):
                bound = float(bounds[column])
                worse[k], last[k] = 0 if bound <= last[k] / 2 else worse[k] + 1, bound
                if bound < best[k].bound_mm:
                    best[k] = Proven(x2[:, column], lam2[:, column], bound)
                going[column] = not (bounds[column] <= enough[column] or worse[k] == MAX_WORSE)
            if not (going.any() and self.kappa > 0):
                break
            if not going.all():
                cases, load = cases[going], LoadCase(load.f[:, going], load.g[:, going])
                x2, lam2, r, s = x2[:, going], lam2[:, going], r[:, going], s[:, going]
            dx, dlam = self.corrections(r.value, s.value, lam2.hi, enough_mm)
            dlam = np.maximum(dlam, -lam2.hi)
            x2, lam2 = x2.plus(dx), lam2.plus(dlam)
            negative = lam2.hi < 0
            lam2 = DoubleDouble(np.where(negative, 0, lam2.hi), np.where(negative, 0, lam2.lo))
            if step == 0 and enough_mm:  # what was in float64 has moved by dx and dλ without rounding
                r, s = units.moved(r, s, dx, dlam)
                bounds, rounding = self.bounds(x2, lam2, r, s, sharpness)
            if step or not (bounds <= enough_mm).all():
                r, s = units.residuals(load, x2, lam2)
                bounds, rounding = self.bounds(x2, lam2, r, s, sharpness)
        D, R = units.D[:, 0], units.R[:, 0]
        return [Proven(answer.x.scaled(D), answer.lam.scaled(R), answer.bound_mm) for answer in best]

    def bounds(
        self,
        x: DoubleDouble,
        lam: DoubleDouble,
        r: Enclosure,
        s: Enclosure,
        sharpness: Sharpness = Sharpness.PLAIN,
    ) -> tuple[Vector, Vector]:
        """The bound of each column (k,) mm, and its part that is due to the roundings of x, r and s."""
        units, at_junction = self.balanced, self.balanced.assembly.at_junction
        z, distance = np.zeros_like(x.lo), np.zeros(x.hi.shape[1])
        if sharpness is Sharpness.TRANSLATED:
            s, z = self._translated(s, lam.hi > 0)
            distance = units.energy_norm(z) / 2
        D, away = at_junction(units.D), at_junction(abs(x.lo) + abs(z) / 2)
        reach = D / np.sqrt(self.kappa)
        if sharpness is not Sharpness.PLAIN:
            reach = np.minimum(reach, np.sqrt(self.compliance))
        error, rounding = self._energy_norms(lam, r, s, distance)
        least = ETA * (x.hi.any(axis=0) | (error > 0))  # either may underflow in mm
        bounds = SAFE * (reach * error + D * away).max(axis=0, initial=0.0) + least
        valid = np.isfinite(bounds) & ~(lam.hi < 0).any(axis=0)
        return np.where(valid, bounds, np.inf), (reach * rounding + D * away).max(axis=0, initial=0.0)

    def _energy_norms(
        self, lam: DoubleDouble, r: Enclosure, s: Enclosure, distance: Vector
    ) -> tuple[Vector, Vector]:
        """‖x − x*‖_K (k,) or more, √(N·mm), of r, s and a distance (k,); its part from roundings."""
        units, pressing = self.balanced, lam.hi > 0
        delta = np.where(pressing, -s.value, np.maximum(-s.value, 0.0))
        uncertain = s.error * (pressing | (s.value < s.error))
        missed, force = length(abs(delta) + uncertain), length(abs(r.value) + r.error)
        if missed.any() and self.pushes:
            columns = zip(s.value.T, s.error.T, uncertain.T, lam.hi.T, strict=True)
            moved, unsure = np.array([self._pushed(*column) for column in columns]).T
        else:
            stretch = np.sqrt(np.divide(units.stiffest, units.sigma2)) if missed.any() else 0.0
            moved, unsure = missed * stretch, length(uncertain) * stretch
        error = SAFE * (force / np.sqrt(self.kappa) + distance + moved)
        rounding = length(r.error) / np.sqrt(self.kappa) + unsure
        return error, rounding

    @np.errstate(over="ignore", invalid="ignore", divide="ignore")
    def energy_error(self, load: LoadCase, x: Vector, lam: Vector) -> float:
        """‖x − x*‖_K or more, √(N·mm), of x (n,) mm with its rounding; λ (m,) N is about the exact one."""
        units = self.balanced
        x, lam = x[:, None] / units.D, np.maximum(lam, 0.0)[:, None] / units.R
        x2, lam2 = DoubleDouble(x, np.zeros_like(x)), DoubleDouble(lam, np.zeros_like(lam))
        r, s = units.residuals(units.load([load]), x2, lam2)
        error = float(self._energy_norms(lam2, r, s, np.zeros(1))[0][0])
        return error if np.isfinite(error) else np.inf

    def _pushed(self, s: Vector, error: Vector, uncertain: Vector, lam: Vector) -> tuple[float, float]:
        """‖x − x*‖_K or more, √(N·mm), and its part due to the errors of s. All arguments are (m,)."""
        assert self.springs is not None
        push = Push.of(self.balanced, self.springs, nearly_closed(s, error, lam))
        return push.distance(s, error, lam), push.distance(np.where(uncertain > 0, 0, s), uncertain, lam)

    def _translated(self, s: Enclosure, pressing: Mask) -> tuple[Enclosure, Matrix]:
        """s + Aᵀz (m, k), and z (n, k). pressing (m, k) : where λ > 0."""
        units, delta = self.balanced, np.where(pressing, -s.value, np.maximum(-s.value, 0.0))
        columns = zip(delta.T, pressing.T, strict=True)
        z = units.solve(units.A @ np.column_stack([self.inverse.forces(*column) for column in columns]))
        roundings = int(np.diff(units.At.indptr).max(initial=0)) + 1
        sizes = abs(s.value) + abs(units.At) @ abs(z)
        rounding = gamma(roundings) * sizes + roundings * ETA * z.any(axis=0)
        return Enclosure(s.value + units.At @ z, s.error + SAFE * rounding), z

    @np.errstate(over="ignore", invalid="ignore", divide="ignore")
    def corrections(self, r: Matrix, s: Matrix, lam: Matrix, enough_mm: float = 0.0) -> tuple[Matrix, Matrix]:
        """dx (n, k) and dλ (m, k) that make r zero, and s at closed contacts, in balanced units.

        r (n, k), s (m, k), λ (m, k) : those of the answers. enough_mm : a displacement that does not count.
        """
        units, At = self.balanced, self.balanced.At
        dx = units.solve(r)
        y = s - At @ dx
        target = np.full(y.shape[1], enough_mm / 2 / self.spread if enough_mm else 0.0)
        if self.springs is not None:
            columns = [self._by_springs(*column) for column in zip(y.T, lam.T, target, strict=True)]
            more, dlam = (np.column_stack(both) for both in zip(*columns, strict=True))
            return dx + more, dlam
        starts = [ClosedContacts(self.inverse, *columns) for columns in zip(y.T, lam.T, strict=True)]
        C = np.column_stack([start.C for start in starts])
        dlam = np.column_stack([start.dlam for start in starts])

        def precondition(v: Matrix) -> Matrix:
            pairs = zip(starts, v.T, strict=True)
            return np.column_stack([start.precondition(column) for start, column in pairs])

        more, dlam = self._closed(y, C, dlam, target, units.solve, precondition)
        return dx + more, dlam

    def _by_springs(self, y: Vector, lam: Vector, target: Vector) -> tuple[Matrix, Matrix]:
        """As `_closed`, for one column, with K and springs at the closed contacts in place of K and M."""
        assert self.springs is not None
        Q_lam = self.balanced.At @ self.balanced.solve(self.balanced.A @ lam[:, None])[:, 0]
        typical = float(lam @ Q_lam) / (float(lam @ lam) or 1.0)
        start = SprungContacts(self.springs, y, lam, np.maximum(self.inverse.diagonal, typical))
        one = y[:, None], start.C[:, None], start.dlam[:, None], target[None]
        return self._closed(*one, start.solve, lambda v: v, start.rho)

    def _closed(
        self,
        y: Matrix,
        C: Mask,
        dlam: Matrix,
        target: Vector,
        solve: Callable[[Matrix], Matrix],
        precondition: Callable[[Matrix], Matrix],
        rho: float = 0.0,
    ) -> tuple[Matrix, Matrix]:
        """dx and dλ by conjugate gradients, from a first dλ; solve : b → (K + ρA_C A_Cᵀ)⁻¹b."""
        A, At, closing = self.balanced.A, self.balanced.At, np.where(C, y, 0.0)
        dx = -solve(A @ (dlam - rho * closing))
        missed = np.where(C, At @ dx - y, 0.0)
        target = np.maximum(target, REDUCTION * length(closing))
        direction, previous = np.zeros_like(missed), np.ones(missed.shape[1])
        flat = FLAT / rho if rho else 0.0
        for _ in range(MAX_PRODUCTS):
            going = length(missed) > target
            if not going.any():
                break
            z = np.where(going, precondition(missed), 0.0)
            product = (missed * z).sum(axis=0)
            direction = z + np.where(product > 0, product / previous, 0.0) * direction
            w = solve(A @ direction)
            q = np.where(C, At @ w, 0.0)
            energy = (direction * q).sum(axis=0)
            bent = going & (energy > flat * (direction**2).sum(axis=0))
            if not bent.any():
                break
            step = np.where(bent, product / energy, 0.0)
            dlam, dx, missed = dlam + step * direction, dx - step * w, missed - step * q
            previous = np.where(product > 0, product, 1.0)
        return dx, dlam + rho * missed


def cached_figure(prepared: Prepared, name: str, make: Callable[[], float]) -> float:
    """A figure of an assembly that takes a while to make, from the cache if it was made before."""
    if prepared.key is None:
        return make()
    code = fingerprint([Path(__file__)], within=["harness/verification", "problems/stiffness"])
    key = storage.digest(name, prepared.key, code)
    _, facts = storage.load_or_make(key, lambda: ({}, {"value": repr(make())}))
    return float(facts["value"])
