"""The optimality conditions of a contact set with a sparse K, solved by one factorisation; Q is not formed.

    [ K    A_C ] [ x   ]   [ force ]
    [ A_Cᵀ  0  ] [ λ_C ] = [ gap_C ]

With springs of a stiffness ρ at the closed contacts (augmented Lagrangian; Hestenes, J. Optim. Theory Appl.
4:303–320, 1969)

    (K + ρ A_C A_Cᵀ) x = force + A_C (ρ gap_C − λ_C),        λ_C ← λ_C + ρ (A_Cᵀx − gap_C),

and each pass reduces the error by a factor of at least 1 + ρ λmin(A_CᵀK⁻¹A_C). What is left is for iterative
refinement. The solvers have a code of their own for this, as for every method.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.stiffness.sparse import sparse_block

from .interior_point import interior_contact_set
from .principal_pivoting import Stop, pivoted

STIFFER = 2.0**7  # ρ in units of the stiffest unknown at a contact: more loses digits of K
PASSES = 3
FEW = 2000  # contacts, for which the interior point may make Q, and pivoting begins where it is told
STIFFENING = 4.0  # of the springs that tell the first set of more
ROUNDING = 2.0**-50  # of the largest term: gaps and forces that are zero but for rounding


class ContactSystem:
    """The conditions for one set of closed contacts, active (m,) bool."""

    def __init__(self, prepared: Prepared, active: NDArray[np.bool_]) -> None:
        assembly = prepared.assembly
        self.assembly, self.prepared = assembly, prepared
        self.rows = np.flatnonzero(active)
        self.A_C = assembly.A[:, self.rows]
        self.rho = 0.0
        if not self.rows.size:
            return
        touched = np.unique(self.A_C.indices)
        largest = float((self.A_C.data**2).max())
        self.rho = STIFFER * float(assembly.K.diagonal[touched].max()) / largest
        K = assembly.K.matrix
        self.factor = sparse_block(sp.csc_array(K + self.rho * (self.A_C @ self.A_C.T)), assembly.nodes)

    def solve(self, force: Vector, gap: Vector) -> tuple[Vector, Vector]:
        """x (n,) and λ (m,), zero at open contacts, to a few digits. force (n,) N, gap (m,) mm."""
        lam = np.zeros(self.assembly.m)
        if not self.rows.size:
            return self.prepared.assembly.K.solve(force), lam
        g, lam_C = gap[self.rows], np.zeros(self.rows.size)
        for _ in range(PASSES):
            x = self.factor.solve(force + self.A_C @ (self.rho * g - lam_C))
            lam_C = lam_C + self.rho * (self.A_C.T @ x - g)
        lam[self.rows] = lam_C
        return x, lam


def solution(
    prepared: Prepared, load: LoadCase, active: NDArray[np.bool_]
) -> tuple[Vector, Vector, float, float]:
    """λ (m,) N with λ = 0 at open contacts, the gaps y = g − Aᵀx (m,) mm there, and the rounding of both."""
    assembly = prepared.assembly
    system = ContactSystem(prepared, active)
    x, lam = system.solve(load.f, load.g)
    dx, dlam = system.solve(load.f - assembly.K.multiply(x) - assembly.A @ lam, load.g - assembly.A.T @ x)
    x, lam = x + dx, lam + dlam
    y = load.g - assembly.A.T @ x
    missed = float(abs(y[active]).max(initial=0.0))
    y[active] = 0.0
    size = float(abs(load.g).max(initial=0.0) + abs(assembly.A.T @ x).max(initial=0.0))
    return lam, y, float(abs(dlam).max(initial=0.0)), max(missed, ROUNDING * size)


def contact_set(
    prepared: Prepared, load: LoadCase, start: NDArray[np.bool_], stop: Stop
) -> NDArray[np.bool_]:
    """The closed contacts by principal pivoting from a first set; a guess, if `stop` ends the search."""
    m = prepared.assembly.m
    if m > FEW:
        start = _with_springs(prepared, load, start, stop)

    def rescue() -> NDArray[np.bool_] | None:
        if m > FEW:
            return None
        return interior_contact_set(prepared.Q, prepared.dual_load(load), stop)

    return pivoted(lambda S: solution(prepared, load, S), start, rescue, stop)[0]


def _with_springs(prepared: Prepared, load: LoadCase, S: NDArray[np.bool_], stop: Stop) -> NDArray[np.bool_]:
    """The contacts that overlap if springs hold them, the set found anew for springs ever stiffer, from as
    stiff as K against the overlap of S to as stiff as its stiffest unknown at a contact.

    From S itself pivoting would open the contacts at its edge alone, a row of them per factorisation.
    """
    assembly = prepared.assembly
    A, K = assembly.A, assembly.K.matrix
    stiffest = float(assembly.K.diagonal[A.indices].max()) / float((A.data**2).max())
    overlap = np.where(S, prepared.dual_load(load), 0.0)
    given_way = float(overlap @ (A.T @ prepared.assembly.K.solve(A @ overlap)))
    rho = float(overlap @ overlap) / given_way if given_way > 0 else stiffest
    while rho < stiffest and S.any() and not stop():
        springs = sp.diags_array(rho * S)
        factor = sparse_block(sp.csc_array(K + A @ springs @ A.T), assembly.nodes)
        S = A.T @ factor.solve(load.f + A @ (springs @ load.g)) > load.g
        rho *= STIFFENING
    return S
