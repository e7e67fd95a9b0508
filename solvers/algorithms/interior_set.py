"""A first contact set by interior-point steps, where there is no banded M ≈ Q⁻¹.

Contact sets see an edge of contact, which creeps by about a row of contacts per set; interior points see all
contacts at once. Mehrotra's steps (interior_point.py) have systems (Q + D) v = b, D = YΛ⁻¹. A dense Q + D is
factored. For a sparse K they are solved by K with springs D⁻¹ at all contacts (Sherman, Morrison, Woodbury),
in one numbering for all D:

    v = D⁻¹ (b − Aᵀ (K + A D⁻¹ Aᵀ)⁻¹ A D⁻¹ b).

No spring is stiffer than ρ, which leaves K its last digits; conjugate gradients correct both.

The start is the paper's idea, forces that open every gap (Algorithm 5), without its loop: with all contacts
glued by springs ρ, (Q + I/ρ) λ = p, and v the largest overlap max p,

    λ_i = max(|λ_i|, v/q_ii),        y_i = max(−p_i, 0) + v.
"""

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Mask, Vector
from problems.forms.compliance import Compliance
from problems.forms.sprung_stiffness import SprungStiffness

from .interior_point import NewtonSteps, mehrotra
from .newton_system import NewtonSystem, Solved, conjugate_gradients

THETA = 0.995
REFINEMENT, PRODUCTS = 1e-2, 20  # of a system, and its conjugate gradients at most
MAX_STEPS = 60
SMALLEST = 1e-15  # of the first μ: further steps are rounding


class Sprung(NewtonSystem):
    """Conjugate gradients preconditioned by K with springs. rho : the stiffest, N/mm."""

    def __init__(self, products: Compliance, At: sp.csr_array, sprung: SprungStiffness, rho: float) -> None:
        self.products, self.At, self.sprung, self.rho = products, At, sprung, rho
        self.begin()

    def begin(self) -> None:
        self.D, self.factorisations = np.full(self.sprung.A.shape[1], np.nan), 0

    def update(self, D: Vector) -> int:
        self.springs = 1 / (D + 1 / self.rho)
        self.inverse = self.sprung.factor(self.springs)
        return 1

    def solve(self, D: Vector, b: Vector, tolerance: float, limit: int) -> Solved:
        """(Q + D) v = b − v/ρ for v from the springs; conjugate gradients where that is not small enough."""
        self.take(D)
        v = self.near(b)
        if v @ v <= tolerance**2 * self.rho * (b @ v):
            return Solved(v, 0, True)
        return conjugate_gradients(self.times_H, b, tolerance, min(limit, PRODUCTS), self.near)

    def near(self, b: Vector) -> Vector:
        """About (Q + D)⁻¹ b."""
        A, At, rho = self.sprung.A, self.At, self.springs
        return rho * (b - At @ self.inverse(A @ (rho * b)))

    def times_H(self, v: Vector) -> Vector:
        return self.products @ v + self.D * v


def interior_set(
    Q: Compliance, system: NewtonSystem, compliance: Vector, p: Vector, glued: Vector
) -> tuple[Mask, Vector, int]:
    """The closed contacts of an interior point, (m,), its λ (m,), and the factorisations that it took.

    It ends with μ = λᵀy/m at 1e-15 of its first value. Closed is a contact whose λ falls less in the last
    step than its y, λ⁺/λ > y⁺/y (Tapia's indicators, which have no unit). p (m,) mm : the overlap without
    contact. compliance : about diag(Q). glued : about Q⁻¹p.
    """
    overlap = float(p.max(initial=0.0))
    newton = NewtonSteps(Q, p, system, THETA, REFINEMENT, np.inf)
    point = newton.at(np.maximum(abs(glued), overlap / compliance), np.maximum(-p, 0.0) + overlap)
    last, enough = point, SMALLEST * point.mu
    for _ in range(MAX_STEPS):
        if point.mu <= enough:
            break
        last, point = point, mehrotra(newton, point)
    return point.lam / last.lam > point.y / last.y, point.lam, system.factorisations
