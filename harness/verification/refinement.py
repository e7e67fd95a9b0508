"""The optimality conditions of a contact set, solved to twice the working precision by iterative refinement.

Nearly exact residuals from the original K, A, f, g; corrections through the Cholesky factors of K and Q_CC,
or through one sparse factorisation (see `augmented`); x and λ as sums of two float64.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared

from . import augmented
from .exact_residual import DoubleDouble, forces, gaps

#: (force, gap) → x and λ of the optimality conditions for a contact set with these right-hand sides.
ContactSolve = Callable[[Vector, Vector], tuple[Vector, Vector]]

MAX_REFINEMENTS = 12
ENOUGH = 1e-20  # relative to x: a smaller correction is the last


def units_of(prepared: Prepared) -> Vector | float:
    """D (n,), the units in which the error is bounded: balanced for a sparse K, mm for a condensed one."""
    return prepared.assembly.K.units if not prepared.assembly.K.dense else 1.0


def refined_solution(
    prepared: Prepared, load: LoadCase, active: NDArray[np.bool_]
) -> tuple[DoubleDouble, DoubleDouble]:
    """x (n,) and λ (m,), zero at open contacts, until a correction is no longer half of the one before it."""
    assembly, units = prepared.assembly, units_of(prepared)
    solve: ContactSolve = (
        augmented.ContactSystem(prepared, active).solve
        if not prepared.assembly.K.dense
        else _dense_system(prepared, np.flatnonzero(active))
    )
    x = DoubleDouble(np.zeros(assembly.n), np.zeros(assembly.n))
    lam = DoubleDouble(np.zeros(assembly.m), np.zeros(assembly.m))
    force, gap = load.f, load.g  # the residuals at zero
    before = np.inf
    for _ in range(MAX_REFINEMENTS):
        dx, dlam = solve(force, gap)
        x, lam = x.plus(dx), lam.plus(dlam)
        step = float(abs(dx / units).max(initial=0))
        if step >= before / 2 or step <= ENOUGH * float(abs(x.hi / units).max(initial=0)):
            break
        before = step
        force = forces(assembly, load.f, x, lam).value
        gap = gaps(assembly, load.g, x).value
    return x, lam


def _dense_system(prepared: Prepared, rows: NDArray[np.intp]) -> ContactSolve:
    """For the closed contacts `rows`, through the factors of K and Q_CC."""
    assembly = prepared.assembly
    A_C, factor = assembly.A[:, rows], None
    if rows.size:
        block = prepared.compliance.submatrix(rows).toarray()
        factor = sla.cho_factor(block, lower=True, overwrite_a=True)

    def solve(force: Vector, gap: Vector) -> tuple[Vector, Vector]:
        x, lam = prepared.assembly.K.solve(force), np.zeros(assembly.m)
        if factor is not None:
            lam[rows] = sla.cho_solve(factor, A_C.T @ x - gap[rows], check_finite=False)
            x = x - prepared.assembly.K.solve(assembly.A @ lam)
        return x, lam

    return solve
