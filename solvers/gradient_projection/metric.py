"""B ≈ Q, by which faces are preconditioned and gradients projected: the diagonal of Q, or a banded M⁻¹.

A step from (λ, y), y = Qλ − p, minimises yᵀd + ½dᵀBd over λ + d ≥ 0, with

    B = diag(Q)/ᾱ    d = max(λ − ᾱ y/diag(Q), 0) − λ, of Dostál only on the face, or only off it
    B = M⁻¹          by block principal pivoting with band factorisations, on all contacts

The preconditioner on a face F, N the other contacts, is B_FF⁻¹: for B = M⁻¹

    (M⁻¹)_FF⁻¹ = M_FF − M_FN M_NN⁻¹ M_NF,

two band products and a band solution.
"""

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from problems.forms.assembly import Mask, Vector
from problems.forms.product import Compliance
from solvers.active_set.block_pivoting import TrialSolution, block_pivoting
from solvers.active_set.contact_sets import OpenFactor, banded_set

STEP_LENGTH = 1.9  # ᾱ λmax: below 2 every projection decreases the objective
POWER_STEPS = 30  # products for λmax, once per assembly
MAX_SETS = 200  # contact sets per projection with M


@dataclass
class Diagonal:
    """B = diag(Q)/ᾱ. diagonal : of Q. alpha : ᾱ = 1.9/λmax(diag(Q)⁻¹Q). sets : contact sets tried
    in this load case."""

    diagonal: Vector
    alpha: float
    sets: int = field(default=0, init=False)

    def precondition(self, F: Mask, r: Vector) -> Vector:
        """B_FF⁻¹ r_F, zero off F."""
        return np.where(F, r, 0.0) / self.diagonal

    def projection(self, lam: Vector, y: Vector, expanding: bool) -> Vector:
        """d with λ + d ≥ 0. expanding : whether the face is to shrink, or else to grow."""
        part = np.where(lam > 0, y if expanding else 0.0, 0.0 if expanding else np.minimum(y, 0.0))
        step: Vector = np.maximum(lam - self.alpha * part / self.diagonal, 0.0) - lam
        return step


@dataclass
class Face(Diagonal):
    """The same, but with M⁻¹ in the preconditioner. factor : of M off the face."""

    factor: OpenFactor

    def precondition(self, F: Mask, r: Vector) -> Vector:
        M = self.factor.M
        v = M.product(np.where(F, r, 0.0)[M.order])
        z = np.empty_like(r)
        z[M.order] = v - M.product(self.factor(~F[M.order]).solve(v))
        z[~F] = 0.0
        return z


class Band(Face):
    """B = M⁻¹, ᾱ = 1."""

    def projection(self, lam: Vector, y: Vector, expanding: bool) -> Vector:
        order = self.factor.M.order
        own, gap, compliance = lam[order], y[order], self.diagonal[order]
        C = np.where(own > 0, compliance * own > gap, gap < 0)
        start = TrialSolution(own, gap, float(abs(gap[own > 0]).max(initial=0.0)))
        found = block_pivoting(partial(banded_set, self.factor, start), C, compliance, 0.0, MAX_SETS)
        self.sets += found.passes
        d = np.empty_like(lam)
        d[order] = np.maximum(found.trial.lam, 0.0) - own
        return d


def step_length(Q: Compliance, diagonal: Vector) -> float:
    """ᾱ of `Diagonal`, with λmax by the power method, in `POWER_STEPS` products."""
    root = np.sqrt(diagonal)
    v, largest = np.random.default_rng(0).uniform(0.5, 1.5, len(root)), 1.0
    for _ in range(POWER_STEPS):
        v /= np.linalg.norm(v)
        v = (Q @ (v / root)) / root
        largest = float(np.linalg.norm(v))
    return STEP_LENGTH / largest
