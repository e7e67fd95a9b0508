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
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg as sla
import scipy.sparse as sp
from numpy.typing import NDArray

from problems.forms.assembly import LoadCase, Matrix, Vector
from problems.forms.compliance import dense_submatrix
from problems.forms.prepared import Prepared
from problems.model.scene import MadeScene, Scene
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from .certificate import certify
from .definite import smallest_eigenvalue
from .exact_residual import DoubleDouble, forces, gaps
from .principal_pivoting import contact_set

MAX_REFINEMENTS = 12
MAX_SET_CORRECTIONS = 20
UNPROVEN = "could not be proven"
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


def reference_of(scene: Scene, prepared: Prepared, load: LoadCase) -> Reference:
    """The reference of a scene: the answer that it was made from, else the refined one."""
    if isinstance(scene, MadeScene):
        made = scene.made
        if made.x is None or made.lam is None:
            return refined_active_set(prepared, load)
        route = "chosen, exact"
        return Reference(made.x, made.lam, made.lam > 0, 0.0, route, made.unit_mm, made.gap_unit_mm)
    return reference(prepared, load)


def reference(prepared: Prepared, load: LoadCase) -> Reference:
    """The reference of a load case, from the cache if it was computed before for these matrices."""
    if prepared.key is None:
        return refined_active_set(prepared, load)
    key = cache.digest("reference", prepared.key, load.f.tobytes(), load.g.tobytes(), _code())

    def made() -> cache.Entry:
        found = refined_active_set(prepared, load)
        arrays: dict[str, NDArray[Any]] = {"x": found.x, "lam": found.lam, "active": found.active}
        return arrays, {"bound_mm": found.bound_mm, "route": found.route}

    arrays, facts = cache.load_or_make(key, made)
    x, lam, active = (np.array(arrays[name]) for name in ("x", "lam", "active"))
    return Reference(x, lam, active, facts["bound_mm"], facts["route"])


def proven_lambda_min(prepared: Prepared) -> float:
    """κ ≤ λmin(K), from the cache if it was proven before for this assembly."""
    if prepared.key is None:
        return _proven_lambda_min(prepared)
    key = cache.digest("lambda_min", prepared.key, _code())
    _, facts = cache.load_or_make(key, lambda: ({}, {"kappa": _proven_lambda_min(prepared)}))
    return float(facts["kappa"])


def _proven_lambda_min(prepared: Prepared) -> float:
    blocks, estimate = prepared.assembly.blocks, prepared.facts.get("lambda_min")
    if not isinstance(estimate, float):
        estimate = min(float(np.linalg.eigvalsh(_dense(K))[0]) for K in blocks)
    return min(smallest_eigenvalue(_dense(K), estimate) for K in blocks)


def _dense(K: Any) -> Matrix:
    return K.toarray() if sp.issparse(K) else K


def _code() -> str:
    """The referee's own code: references of other code are computed anew."""
    return fingerprint([Path(__file__)], within=["harness/verification"])


@np.errstate(over="ignore", invalid="ignore")
def refined_active_set(prepared: Prepared, load: LoadCase) -> Reference:
    """Active set, refinement, certificate."""
    p = prepared.dual_load(load)
    meets = bool((p > 0).any())  # else Q is not needed
    active = contact_set(prepared.compliance, p) if meets else np.zeros(len(p), dtype=bool)
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
    if not np.isfinite(proof.bound_mm):
        route = UNPROVEN
    elif prepared.assembly.altered:
        route = "proven; what reading has rounded or symmetrised is counted"
    else:
        route = "proven" + (f", {undecided} contacts weakly active" if undecided else "")
    return Reference(proof.x.hi, proof.lam.hi, active, proof.bound_mm, route)


def _refine(
    prepared: Prepared, load: LoadCase, active: NDArray[np.bool_]
) -> tuple[DoubleDouble, DoubleDouble]:
    assembly = prepared.assembly
    rows = np.flatnonzero(active)
    A_C = assembly.A[:, rows]
    factor = None
    if rows.size:
        block = dense_submatrix(prepared.compliance, rows)
        factor = sla.cho_factor(block, lower=True, overwrite_a=True)
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
