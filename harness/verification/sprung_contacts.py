"""Makes the gaps of closed contacts zero where there is neither M nor Q: by K with springs at them.

With A_Cᵀdx = s_C, springs of a stiffness ρ at the contacts of C change nothing but the condition (augmented
Lagrangian; Hestenes, J. Optim. Theory Appl. 4:303–320, 1969):

    (K + ρA_C A_Cᵀ) dx + A dλ = r + ρA_C s_C,        A_Cᵀdx = s_C,        dλ_N = −λ_N.

The matrix of dλ_C becomes A_Cᵀ(K + ρA_C A_Cᵀ)⁻¹A_C = Q_CC (I + ρQ_CC)⁻¹, with eigenvalues q/(1 + ρq): the
more of those of Q_CC are above 1/ρ, the fewer steps conjugate gradients take. The first step from dλ_C = 0,
dλ_C = −ρ (s_C − A_Cᵀdx), tells the signs of a set, and such a step at the end leaves in r the rounding of a
solution alone. In balanced units ρ = max(1, 2⁴⁰κ): no softer than an unknown, and the last twelve bits of K
are kept.
"""

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Vector
from problems.forms.sprung_stiffness import SprungStiffness
from problems.stiffness.block import scaled

from .balanced_units import Balanced

KEPT = 2.0**40
MAX_SETS = 10  # contact sets tried for one load case


class SprungFactors:
    """Factorisations of K with springs, in balanced units. kappa : κ ≤ λmin(K), or 0."""

    def __init__(self, units: Balanced, kappa: float) -> None:
        assembly, D = units.assembly, units.D[:, 0]
        self.sprung = SprungStiffness(scaled(assembly.K.matrix, D, D), sp.csc_array(units.A), assembly.nodes)
        self.rho = max(1.0, KEPT * kappa)


class SprungContacts:
    """The closed contacts C (m,) of a load case, and a first dλ (m,).

    C = {λ · compliance > y}, without those whose force would become negative, with those that would overlap.
    y, lam, compliance (m,) : gaps that dλ is to close, λ, and estimates of the diagonal of Q.
    """

    def __init__(self, springs: SprungFactors, y: Vector, lam: Vector, compliance: Vector) -> None:
        A, At, self.rho = springs.sprung.A, springs.sprung.A.T, springs.rho
        C = lam * compliance > y
        for _ in range(MAX_SETS):
            self.C, self.solve = C, springs.sprung.factor(np.where(C, self.rho, 0.0))
            gap = y - At @ self.solve(A @ np.where(C, self.rho * y, lam))
            self.dlam = np.where(C, -self.rho * gap, -lam)
            wrong = np.where(C, lam + self.dlam, gap) < 0
            if not wrong.any():
                return
            C = C ^ wrong
