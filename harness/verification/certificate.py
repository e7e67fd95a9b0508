"""A proven bound on the displacement error of x, λ ≥ 0 with Aᵀx ≤ g.

Let r = f − Kx − Aλ, s = g − Aᵀx ≥ 0 and e = x − x*. From Kx* = f − Aλ* and s*ᵀλ* = 0,

    ‖e‖²_K = (s* − s)ᵀ(λ* − λ) − eᵀr ≤ sᵀλ + ‖e‖_K ‖r‖_{K⁻¹},

so ‖e‖_K ≤ ‖r‖_{K⁻¹} + √(sᵀλ), and with 0 < κ ≤ λmin(K)

    max|e_i| ≤ ‖e‖₂ ≤ (‖r‖₂/√κ + √(sᵀλ)) / √κ.

Where the unknowns have mixed units, the same is done in units D_i of each, powers of two: with Dr for r,
κ ≤ λmin(DKD) and e = Dẽ, so that |e_i| ≤ D_i ‖ẽ‖₂.

Nothing is assumed about the active set: weakly active contacts (λ_i = s_i = 0) need no special treatment.
With enclosures of r and s, and x, λ as sums of two float64, both terms are far below the rounding of x.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from problems.forms.assembly import Assembly, LoadCase, Vector

from .exact_residual import ETA, DoubleDouble, Enclosure, U, forces, gaps
from .length import length

MAX_REPAIRS = 20


@dataclass(frozen=True)
class Certificate:
    """x (n,) feasible, λ (m,) ≥ 0, and the contacts proven closed or open; max|x.hi − x*| ≤ bound_mm over the
    displacements that are asked for.

    bound_mm is infinite, never NaN, where nothing can be proven.
    """

    x: DoubleDouble
    lam: DoubleDouble
    bound_mm: float
    closed: NDArray[np.bool_]
    open: NDArray[np.bool_]


@np.errstate(over="ignore", invalid="ignore")
def certify(
    assembly: Assembly,
    load: LoadCase,
    x: DoubleDouble,
    lam: DoubleDouble,
    active: NDArray[np.bool_],
    kappa: float,
    units: Vector | float = 1.0,
) -> Certificate:
    """Make x feasible and λ ≥ 0 by minimal changes, and bound the remaining error.

    kappa : κ, N/mm, or without a unit if D balances K. units : D (n,), powers of two.
    """
    units = np.broadcast_to(units, assembly.n)
    negative = lam.hi < 0
    lam = DoubleDouble(np.where(negative, 0.0, lam.hi), np.where(negative, 0.0, lam.lo))
    x, s, feasible = _repaired(assembly, load.g, x, active)
    r = forces(assembly, load.f, x, lam)
    undecided = np.zeros(assembly.m, dtype=bool)
    if not (feasible and kappa > 0):
        return Certificate(x, lam, np.inf, undecided, undecided)
    inflation = 1 + 4 * (assembly.n + 2) * U  # for rounding in sums of that many positive terms
    norm = float(length(units * (abs(r.value) + r.error))) * inflation
    opening, pressing = s.value + s.error, lam.hi + abs(lam.lo)
    slack = float(opening @ pressing) * inflation + ETA * np.count_nonzero(opening * (pressing > 0))
    error = (norm / np.sqrt(kappa) + np.sqrt(slack)) / np.sqrt(kappa) * inflation
    of_each = assembly.at_junction(units * error + abs(x.lo))
    bound = float(of_each.max(initial=0)) * inflation
    if not np.isfinite(bound):
        return Certificate(x, lam, np.inf, undecided, undecided)
    return Certificate(x, lam, bound, *_proven(assembly, lam, s, r, error, units))


def _repaired(
    assembly: Assembly, g: Vector, x: DoubleDouble, active: NDArray[np.bool_]
) -> tuple[DoubleDouble, Enclosure, bool]:
    """x moved by A(AᵀA)⁻¹d so that active gaps vanish and no gap is negative, and whether that is proven."""
    A = sp.csc_array(assembly.A)
    factor = splu(sp.csc_array(A.T @ A)) if assembly.m else None
    s = gaps(assembly, g, x)
    d = np.where(active | (s.value < 0), s.value, 0.0)
    for k in range(MAX_REPAIRS):
        if factor is not None and d.any():
            x = x.plus(A @ factor.solve(d))
            s = gaps(assembly, g, x)
        overlapping = ~(s.value - s.error >= 0)
        if not overlapping.any():
            return x, s, True
        d = np.where(overlapping, s.value - 2.0 ** (k + 1) * s.error, 0.0)
    return x, s, False


def _proven(
    assembly: Assembly, lam: DoubleDouble, s: Enclosure, r: Enclosure, error: float, units: Vector
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Contacts proven to be closed with a force, and proven to be open.

    |s* − s| ≤ |Da|₂ ‖ẽ‖₂. From A(λ* − λ) = Ke + r, in a row i of A with a single entry a
    |λ* − λ| ≤ (‖K_i D‖₂ ‖ẽ‖₂ + |r_i|)/|a|, where ‖K_i D‖₂ ≤ √(K_ii · trace DKD) as K is positive definite.
    """
    A = sp.csc_array(assembly.A)
    in_units = sp.csc_array(sp.diags_array(units) @ A)
    norms = np.sqrt(np.asarray((in_units * in_units).sum(axis=0)).ravel())
    is_open = s.value - s.error > 1.01 * norms * error
    diagonal = assembly.K.diagonal
    scaled = diagonal * units**2
    own = assembly.K.slices
    trace = np.concatenate([np.full(rows.stop - rows.start, scaled[rows].sum()) for rows in own])
    rows = sp.csr_array(A)
    single = np.flatnonzero(np.diff(rows.indptr) == 1)
    entry = rows.indptr[single]
    uncertainty = 1.01 * (
        (np.sqrt(diagonal) * np.sqrt(trace))[single] * error + abs(r.value[single]) + r.error[single]
    )
    of_contact = rows.indices[entry]
    certain = lam.hi[of_contact] - abs(lam.lo[of_contact]) > uncertainty / abs(rows.data[entry])
    is_closed = np.zeros(assembly.m, dtype=bool)
    is_closed[of_contact[certain]] = True
    return is_closed, is_open
