"""The answer that every other is measured against: an active-set solution, refined, with a proven bound.

For the contact set C found by block principal pivoting, the optimality conditions are linear,

    [ K    A_C ] [ x   ]   [ f   ]
    [ A_Cᵀ  0  ] [ λ_C ] = [ g_C ],

and are solved by iterative refinement: nearly exact residuals from the original K, A, f, g, corrections
through the Cholesky factors of K and Q_CC, x and λ as sums of two float64. The set is corrected and the
refinement repeated until λ_C ≥ 0 and g − Aᵀx ≥ 0 hold for the refined values. The bound is that of
`certificate.py` and holds whatever C is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from problems.forms.assembly import LoadCase, Prepared, Vector
from problems.manufactured.ladder import ManufacturedProblem
from problems.storage import cache

from .certificate import certify
from .definite import smallest_eigenvalue
from .exact_residual import DoubleDouble, forces, gaps
from .principal_pivoting import contact_set

MAX_REFINEMENTS = 12
MAX_SET_CORRECTIONS = 20
ENOUGH = 1e-20  # a correction so small, relative to x, was the last


@dataclass(frozen=True)
class Reference:
    """x (n,) in mm, λ (m,) in N, the closed contacts, and a bound on max|x − x*| in mm.

    unit_mm, gap_unit_mm : the lengths that 1 stands for in x and in the gaps, where those are not in mm.
    """

    x: Vector
    lam: Vector
    active: NDArray[np.bool_]
    bound_mm: float
    route: str
    unit_mm: Vector | float = 1.0
    gap_unit_mm: Vector | float = 1.0


def made_reference(made: ManufacturedProblem, prepared: Prepared) -> Reference:
    """The reference of a rung: the answer that it was made from, else the refined one."""
    if made.x is None or made.lam is None:
        return refined_active_set(prepared, made.load)
    route = "chosen, exact"
    return Reference(made.x, made.lam, made.lam > 0, 0.0, route, made.unit_mm, made.gap_unit_mm)


def reference(scene_key: str, prepared: Prepared, load: LoadCase) -> Reference:
    """The reference of a scene, from the cache if it was computed before."""
    built = prepared.facts.get("seconds")
    key = cache.digest("reference", 4, scene_key, built, load.f.tobytes(), load.g.tobytes())
    found = cache.load(key)
    if found is None:
        made = refined_active_set(prepared, load)
        arrays: dict[str, NDArray[Any]] = {"x": made.x, "lam": made.lam, "active": made.active}
        cache.store(key, arrays, {"bound_mm": made.bound_mm, "route": made.route})
        return made
    arrays, facts = found
    x, lam, active = (np.array(arrays[name]) for name in ("x", "lam", "active"))
    return Reference(x, lam, active, facts["bound_mm"], facts["route"])


def proven_lambda_min(prepared: Prepared) -> float:
    """κ ≤ λmin(K), from the cache if it was proven before for this assembly."""
    facts, blocks = prepared.facts, prepared.assembly.blocks
    measured = facts.get("lambda_min"), facts.get("seconds")
    key = cache.digest("lambda_min", 2, *measured, [float(np.trace(K)) for K in blocks])
    found = cache.load(key) if None not in measured else None
    if found is not None:
        return float(found[1]["kappa"])
    estimate = facts.get("lambda_min")
    if not isinstance(estimate, float):
        estimate = min(float(np.linalg.eigvalsh(K)[0]) for K in blocks)
    kappa = min(smallest_eigenvalue(K, estimate) for K in blocks)
    if None not in measured:
        cache.store(key, {}, {"kappa": kappa})
    return kappa


def refined_active_set(prepared: Prepared, load: LoadCase) -> Reference:
    """Active set, refinement, certificate."""
    active = contact_set(prepared.Q, prepared.dual_load(load))
    for _ in range(MAX_SET_CORRECTIONS):
        x, lam = _refine(prepared, load, active)
        s = gaps(prepared.assembly, load.g, x)
        tiny = ENOUGH * abs(x.hi).max(initial=0) + s.error
        wrong = np.where(active, lam.hi < 0, s.value < -tiny)
        if not wrong.any():
            break
        active = active ^ wrong
    proof = certify(prepared.assembly, load, x, lam, active, proven_lambda_min(prepared))
    undecided = int((~(proof.closed | proof.open)).sum())
    route = "proven" + (f", {undecided} contacts weakly active" if undecided else "")
    return Reference(proof.x.hi, proof.lam.hi, active, proof.bound_mm, route)


def _refine(
    prepared: Prepared, load: LoadCase, active: NDArray[np.bool_]
) -> tuple[DoubleDouble, DoubleDouble]:
    assembly = prepared.assembly
    rows = np.flatnonzero(active)
    A_C = assembly.A[:, rows]
    block = prepared.Q[np.ix_(rows, rows)].T  # symmetric, stored as LAPACK takes it
    factor = sla.cho_factor(block, lower=True, overwrite_a=True) if rows.size else None
    x = DoubleDouble(np.zeros(assembly.n), np.zeros(assembly.n))
    lam = DoubleDouble(np.zeros(assembly.m), np.zeros(assembly.m))
    force, gap = load.f, load.g  # the residuals at zero
    before = np.inf
    for _ in range(MAX_REFINEMENTS):
        dx = prepared.solve_K(force)
        if factor is not None:
            dlam = np.zeros(assembly.m)
            dlam[rows] = sla.cho_solve(factor, A_C.T @ dx - gap[rows], check_finite=False)
            dx = dx - prepared.solve_K(assembly.A @ dlam)
            lam = lam.plus(dlam)
        x = x.plus(dx)
        step = float(abs(dx).max(initial=0))
        if step >= before / 2 or step <= ENOUGH * float(abs(x.hi).max(initial=0)):
            break
        before = step
        force = forces(assembly, load.f, x, lam).value
        gap = gaps(assembly, load.g, x).value
    return x, lam
