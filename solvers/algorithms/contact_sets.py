"""Solutions of contact sets, with M ≈ Q⁻¹ or with factorisations of K in place of Q⁻¹.

From a point (λ, y) with y exact, the problem with Q replaced by M⁻¹ has λ⁺ = λ + Mz with z = y⁺ − y. For a
set C, N the other contacts, y⁺_C = 0 and λ⁺_N = 0, so that

    z_C = −y_C,    M_NN z_N = (M y_C)_N − λ_N.

In terms of the change z, rounding shrinks with what is left to correct.

Where there is neither M nor Q, as K has no band or contacts lie all over an area, the change is

    [ K    A_C ] [ dx  ]   [ A_N λ_N ]
    [ A_Cᵀ  0  ] [ dλ_C ] = [ y_C     ]

which springs of a stiffness ρ at the contacts of C give (augmented Lagrangian; Hestenes, J. Optim. Theory
Appl. 4:303–320, 1969),

    (K + ρ A_C A_Cᵀ) dx = A_N λ_N + A_C (ρ y_C − dλ_C),        r = A_Cᵀdx − y_C = 0.

Conjugate gradients in dλ_C from zero: the matrix has the eigenvalues q/(1 + ρq), q those of Q_CC, so that all
far above 1/ρ count as one. The next product with Q corrects the rest.

In both ways, ever stiffer springs find a first set; where that creeps, an interior point (interior_set.py).
"""

from dataclasses import dataclass

import numpy as np

from problems.forms.assembly import Mask, Vector
from problems.forms.banded_inverse import BandedInverse, BandFactor
from problems.forms.compliance import ComplianceProducts, CountedProducts
from problems.forms.prepared import EPS, Prepared
from problems.forms.sprung_stiffness import SprungStiffness
from solvers.base import DualLoadCase

from .block_pivoting import SIGN_UNCERTAINTY, TrialSolution
from .interior_set import Sprung, interior_set

STIFFER = 2.0**7  # ρ in units of the stiffest unknown at a contact, or more where K is well conditioned
KEPT = 2.0**40  # ρ in these units times cond(K): the springs keep the last twelve bits of K
STEPS, ENOUGH = 10, 2.0**-20  # of conjugate gradients; of |y_C|
GROWTH = 4.0  # of ρ per step; with twice as much the edge lags, and pivoting then needs more sets


@dataclass
class OpenFactor:
    """M and its Cholesky factor on the last open set.

    room : the memory of the factors; fresh memory for each would take longer than the factor itself.
    """

    M: BandedInverse
    last: BandFactor | None = None
    room: Vector | None = None

    def __call__(self, N: Mask) -> BandFactor:
        if self.last is None or (self.last.S ^ N).any():
            if self.room is None:
                self.room = np.empty(self.M.band.size)
            self.last = self.M.factor(N, self.room)
        return self.last


def banded_set(factor: OpenFactor, start: TrialSolution, C: Mask) -> TrialSolution:
    """λ⁺ and y⁺ of the set C, vectors in the order of M. start : the point (λ, y), its rounding |y_C|."""
    M, lam, y = factor.M, start.lam, start.y
    y_C = np.where(C, y, 0.0)
    z: Vector = factor(~C).solve(M.product(y_C) - lam) - y_C
    new = np.where(C, lam + M.product(z), 0.0)
    return TrialSolution(new, np.where(C, 0.0, y + z), SIGN_UNCERTAINTY * start.rounding)


def yielding_set(M: BandedInverse, compliance: Vector, start: TrialSolution) -> Mask:
    """The contact set of ever stiffer springs in place of contacts; vectors in the order of M.

    With springs ρ_i = τ/q_ii and λ⁺ = λ − ρy⁺ on C = {λ − ρy > 0}, λ⁺ = 0 on N (augmented Lagrangian),

        (M + diag(ρ_C)) y⁺ = My − λ_N,

    one step of Newton's method per τ, from the stiffness of the body at the overlaps v of the start,
    vᵀMv / Σ v_i²/q_ii, to that of M. An edge of contact moves as far as the springs give way, however fine
    the mesh, where pivoting moves it by a row of contacts per set (Hintermüller and Kunisch, SIAM J. Optim.
    17:159–187, 2006). Where nothing overlaps, C = {λ_i q_ii > y_i}.
    """
    lam, y, overlap = start.lam, start.y, np.maximum(-start.y, 0.0)
    if not overlap.any():
        return lam * compliance > y
    tau = float(overlap @ M.product(overlap)) / float(overlap @ (overlap / compliance))
    stiffest, My = float((M.band[0] * compliance).mean()), M.product(y)
    C = lam * compliance > tau * y
    while tau < stiffest:
        rho = np.where(C, tau / compliance, 0.0)
        y = M.stiffened_factor(rho).solve(My - np.where(C, 0.0, lam))
        C, tau = lam * compliance > tau * y, GROWTH * tau
    return C


class ContactSprings:
    """Factorisations of K with springs at closed contacts, in place of Q⁻¹; vectors in the order of A.

    products : with Q. stiffest : the largest stiffness of an unknown at a contact, N/mm. rho : that of the
    springs, N/mm.
    """

    def __init__(self, prepared: Prepared) -> None:
        assembly = prepared.assembly
        compliance = ComplianceProducts(assembly.K, assembly.A)
        self.products, self.A, self.At = CountedProducts(compliance), assembly.A, compliance.At
        self.diagonal = prepared.approximate_inverse.diagonal
        self.sprung = SprungStiffness(assembly.K.matrix, self.A, assembly.nodes)
        stiffest = float(assembly.K.diagonal[self.A.indices].max(initial=0.0))
        self.stiffest = stiffest / ((self.A.data**2).max(initial=0.0) or 1.0)
        self.rho = self.stiffest * max(STIFFER, KEPT / prepared.condition)

    def begin(self) -> None:
        """Every set is factored anew."""

    def set(self, start: TrialSolution, C: Mask) -> TrialSolution:
        """λ⁺ and y⁺ of the set C, from a point (λ, y)."""
        A, At, lam, y, rho = self.A, self.At, start.lam, start.y, self.rho
        inverse, change = self.sprung.factor(np.where(C, rho, 0.0)), np.where(C, 0.0, -lam)
        closed = At @ inverse(A @ np.where(C, rho * y, lam))
        step = r = np.where(C, closed - y, 0.0)
        size, enough = float(r @ r), ENOUGH**2 * float(y[C] @ y[C])
        for _ in range(STEPS):
            if size <= enough:
                break
            Q_step = At @ inverse(A @ step)
            if (curvature := float(step @ Q_step)) * rho <= EPS * float(step @ step):
                break  # closed contacts that depend on one another: no λ gives the rest
            alpha = size / curvature
            change, closed = change + alpha * step, closed - alpha * Q_step
            r, last = np.where(C, closed - y, 0.0), size
            size = float(r @ r)
            step = r + size / last * step
        lam = lam + change + rho * r
        return TrialSolution(lam, np.where(C, 0.0, y - closed), SIGN_UNCERTAINTY * start.rounding)

    def first_set(self, load: DualLoadCase) -> Mask:
        """The contacts that overlap with springs as stiff as K, (m,), found from λ = 0 like `yielding_set`.

        One step of Newton's method per ρ, from the stiffness of the body to that of K.
        """
        A, overlap = self.A, np.maximum(load.p, 0.0)
        C = overlap > 0
        if not C.any():
            return C
        rho = float(overlap @ overlap / (overlap @ (self.products @ overlap)))
        while rho < self.stiffest and C.any():
            x = self.sprung.factor(np.where(C, rho, 0.0))(load.f + A @ np.where(C, rho * load.g, 0.0))
            C, rho = self.At @ x > load.g, GROWTH * rho
        return C

    def interior_set(self, load: DualLoadCase) -> tuple[Mask, Vector, int]:
        """The closed contacts of an interior point, (m,), its λ (m,), and the factorisations that it took."""
        if not (load.p > 0).any():
            return load.p > 0, np.zeros_like(load.p), 0
        system = Sprung(self.products, self.At, self.sprung, self.rho)
        system.take(np.zeros_like(load.p))
        return interior_set(self.products, system, self.diagonal, load.p, system.near(load.p))
