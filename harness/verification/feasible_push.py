"""Bounds the error of x where contacts depend on one another: a push d makes every gap nonnegative.

With Kx + Aλ = f, λ ≥ 0, s = g − Aᵀx and any d with Aᵀd ≥ −s, x − d is feasible, and its duality gap to λ is
½‖d‖²_K + λᵀ(s + Aᵀd). As x minimises the Lagrangian for λ, ½‖x − x*‖²_K is at most what the dual objective
lacks at λ, which is at most that gap:

    ‖x − x*‖_K ≤ √(‖d‖²_K + 2λᵀ(s + Aᵀd)).

K must be positive definite; A may have any rank. Here d = θp with the least θ that suffices, and p opens all
contacts that are nearly closed: from p = 0 it is moved by Newton's method for Σ exp(−a_jᵀp) over them, each
step regularised by K and so short that no a_jᵀp changes by more than five. There is none where contacts hold
each other closed, as aᵀx ≤ 0 and −aᵀx ≤ 0 do. The bound shrinks with √s only: x is refined in twice the
working precision.
"""

from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Mask, Vector
from problems.stiffness import gamma

from .balanced_units import Balanced
from .enclosure import ETA, SAFE
from .sprung_contacts import SprungFactors

NEARLY_CLOSED = 2.0**20  # times the largest overlap: a larger gap stays open
LONGEST, ENOUGH = 5.0, 0.1  # of a_jᵀp in a step, and at the end
MAX_STEPS = 30


@dataclass(frozen=True)
class Push:
    """p, in balanced units: Aᵀp (m,) to within `error` (m,), and ‖p‖_K or more."""

    opening: Vector
    error: Vector
    energy_norm: float

    @classmethod
    def of(cls, units: Balanced, springs: SprungFactors, closed: Mask) -> "Push":
        """The push that opens the contacts `closed` (m,)."""
        sprung, A = springs.sprung, springs.sprung.A
        p, opening = np.zeros(A.shape[0]), np.zeros(A.shape[1])
        for _ in range(MAX_STEPS):
            least = float(opening[closed].min(initial=np.inf))
            if least >= ENOUGH:
                break
            forces = np.where(closed, springs.rho * np.exp(np.minimum(least - opening, 0.0)), 0.0)
            step = sprung.factor(forces)(A @ forces)
            change = A.T @ step
            share = LONGEST / max(float(abs(change).max()), LONGEST)
            p, opening = p + share * step, opening + share * change
        roundings = np.diff(units.At.indptr)
        error = SAFE * (gamma(roundings) * (abs(units.At) @ abs(p)) + roundings * ETA)
        return cls(units.At @ p, error, float(units.energy_norm(p[:, None])[0]))

    @np.errstate(over="ignore", invalid="ignore", divide="ignore")
    def distance(self, s: Vector, error: Vector, lam: Vector) -> float:
        """√(‖d‖²_K + 2λᵀ(s + Aᵀd)) or more, for gaps s ± error (m,); infinite if no multiple of p is a d."""
        least, opening = s - error, self.opening - self.error
        overlap = least < 0
        theta = SAFE * float((-least / opening)[overlap].max(initial=0.0)) + ETA * overlap.any()
        closing = ~overlap & ~(least + SAFE * theta * opening >= 0)
        if closing.any() or not (opening[overlap] > 0).all():
            return np.inf
        gap = float(lam @ (abs(s) + error + theta * (abs(self.opening) + self.error)))
        return float(SAFE * np.sqrt((theta * self.energy_norm) ** 2 + 2 * SAFE * gap + len(s) * ETA))


def nearly_closed(s: Vector, error: Vector, lam: Vector) -> Mask:
    """The contacts (m,) that a push has to open: λ > 0, or a gap that is small beside the largest overlap."""
    mask: Mask = (lam > 0) | (s - error <= NEARLY_CLOSED * float((error - s).max(initial=0.0)))
    return mask
