"""The reference that answers are compared with: an active-set solution, refined, with a proven bound.

For the contact set C found by block principal pivoting, the optimality conditions are linear,

    [ K    A_C ] [ x   ]   [ f   ]
    [ A_Cᵀ  0  ] [ λ_C ] = [ g_C ],

and are solved by iterative refinement: nearly exact residuals from the original K, A, f, g, corrections
through the Cholesky factors of K and Q_CC, x and λ as sums of two float64. The set is corrected and the
refinement repeated until λ_C ≥ 0 and g − Aᵀx ≥ 0 hold for the refined values. The bound is that of
`certificate.py` and holds whatever C is.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.model.scene import MadeScene, Scene
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from . import augmented
from .certificate import certify
from .definite import smallest_eigenvalue
from .exact_residual import gaps
from .principal_pivoting import Stop, contact_set
from .refinement import ENOUGH, refined_solution, units_of
from .sparse_bound import PROVEN_ENOUGH_MM, Proven, SparseBound

MAX_SET_CORRECTIONS = 20
STOPPED = "the search for the contact set was stopped"
UNPROVEN = "could not be proven"
KNOWN, ESTIMATED = 0.9, 0.5  # shares of λmin from Lanczos, and of an estimate that is no smaller


@dataclass(frozen=True)
class Reference:
    """x (n,) in mm, λ (m,) in N, the closed contacts, and a bound on max|x − x*| in mm.

    unit_mm, gap_unit_mm : the length of one unit of x and of the gaps, mm.
    """

    x: Vector
    lam: Vector
    active: NDArray[np.bool_]
    bound_mm: float
    route: str
    unit_mm: Vector | float = 1.0
    gap_unit_mm: Vector | float = 1.0


def default_limit_s(m: int) -> float:
    """Seconds for the search of the contact set among m contacts: 60 per thousand, at least 60."""
    return 0.06 * max(m, 1000)


def reference_of(
    scene: Scene,
    prepared: Prepared,
    load: LoadCase,
    limit_s: float | None = None,
    guess: Vector | None = None,
) -> Reference:
    """The reference of a scene: the answer that it was made from, if any, else the refined one.

    limit_s : of the search for the contact set, by default `default_limit_s(m)`. What it has found by then is
        refined and certified; if the bound is wide, answers cannot be judged, and `route` says why.
    """
    if isinstance(scene, MadeScene):
        made = scene.made
        if made.x is None or made.lam is None:
            return reference(prepared, load, limit_s, guess)
        route = "chosen, exact"
        return Reference(made.x, made.lam, made.lam > 0, 0.0, route, made.unit_mm, made.gap_unit_mm)
    return reference(prepared, load, limit_s, guess)


def reference(
    prepared: Prepared,
    load: LoadCase,
    limit_s: float | None = None,
    guess: Vector | None = None,
) -> Reference:
    """The reference of a load case, from the cache if it was computed before for these matrices."""
    if prepared.key is None:
        return refined_active_set(prepared, load, limit_s, guess)
    key = cache.digest("reference", prepared.key, load.f.tobytes(), load.g.tobytes(), _code())

    stored = cache.load(key)
    if stored is None:
        found = refined_active_set(prepared, load, limit_s, guess)
        if STOPPED not in found.route:  # else a longer search may find more
            made: dict[str, NDArray[Any]] = {"x": found.x, "lam": found.lam, "active": found.active}
            cache.store(key, made, {"bound_mm": found.bound_mm, "route": found.route})
        return found
    arrays, facts = stored
    x, lam, active = (np.array(arrays[name]) for name in ("x", "lam", "active"))
    return Reference(x, lam, active, facts["bound_mm"], facts["route"])


def of_refined(refined: Proven) -> Reference:
    """What a refinement in the sparse form has proven."""
    return Reference(refined.x.hi, refined.lam.hi, refined.active, refined.bound_mm, "proven")


def sparse_bound(prepared: Prepared) -> SparseBound | None:
    """What load cases of an assembly share of their proofs; None where nothing can be proven so."""
    return SparseBound.of(prepared, proven_lambda_min(prepared))


def proven_lambda_min(prepared: Prepared) -> float:
    """κ ≤ λmin(DKD), from the cache if it was proven before for this assembly."""
    if prepared.key is None:
        return _proven_lambda_min(prepared)
    key = cache.digest("lambda_min", prepared.key, _code())
    _, facts = cache.load_or_make(key, lambda: ({}, {"kappa": _proven_lambda_min(prepared)}))
    return float(facts["kappa"])


def _proven_lambda_min(prepared: Prepared) -> float:
    K, facts = prepared.assembly.K, prepared.facts
    D = np.broadcast_to(units_of(prepared), K.size)
    least, conditions = facts.get("lambda_min"), facts.get("cond_blocks")
    if isinstance(least, float) and isinstance(conditions, list):  # max_j k_jj / cond(K_i) ≤ λmin(K_i)
        pairs = zip(K.blocks, conditions, strict=True)
        guesses = [KNOWN * max(least, float(block.diagonal().max()) / c) for block, c in pairs]
    else:
        guesses = [ESTIMATED * about for about in K.least_eigenvalues(D)]
    return smallest_eigenvalue(K, D, guesses)


def _code() -> str:
    """The fingerprint of the code for references: those of other code are recomputed."""
    within = ["harness/verification", "problems/stiffness"]
    return fingerprint([Path(__file__)], within)


def refined_active_set(
    prepared: Prepared,
    load: LoadCase,
    limit_s: float | None = None,
    guess: Vector | None = None,
) -> Reference:
    """The active set, refined and certified.

    guess : λ (m,) N of an answer, from whose set the search starts; with a sparse K the answer itself is
        refined, if that proves enough. The proof does not depend on where it came from.
    """
    if guess is not None and not prepared.assembly.K.dense:
        bound = sparse_bound(prepared)
        refined = bound.proven([load], [guess])[0] if bound else None
        if refined is not None and refined.bound_mm <= PROVEN_ENOUGH_MM:
            return of_refined(refined)
    return certified_active_set(prepared, load, limit_s, guess)


@np.errstate(over="ignore", invalid="ignore")
def certified_active_set(
    prepared: Prepared, load: LoadCase, limit_s: float | None = None, guess: Vector | None = None
) -> Reference:
    """The same by factorisations for contact sets, the first that of the guess."""
    p = prepared.dual_load(load)
    active = np.zeros(len(p), dtype=bool)
    limit_s = default_limit_s(len(p)) if limit_s is None else limit_s
    end = time.monotonic() + limit_s
    if guess is not None:
        active = guess > 0
    elif (p > 0).any():  # else Q is not needed
        active = _contact_set(prepared, load, p, stop=lambda: time.monotonic() > end)
    stopped = time.monotonic() > end
    for _ in range(MAX_SET_CORRECTIONS):
        x, lam = refined_solution(prepared, load, active)
        s = gaps(prepared.assembly, load.g, x)
        tiny = ENOUGH * abs(prepared.assembly.at_junction(x.hi)).max(initial=0) + s.error
        wrong = np.where(active, lam.hi < 0, s.value < -tiny)
        if not wrong.any():
            break
        active = active ^ wrong
    kappa, units = proven_lambda_min(prepared), units_of(prepared)
    proof = certify(prepared.assembly, load, x, lam, active, kappa, units)
    undecided = int((~(proof.closed | proof.open)).sum())
    if not np.isfinite(proof.bound_mm):
        route = UNPROVEN
    else:
        route = "proven" + (f", {undecided} contacts weakly active" if undecided else "")
    if stopped:
        route += f", {STOPPED} after {limit_s:g} s"
    return Reference(proof.x.hi, proof.lam.hi, active, proof.bound_mm, route)


def _contact_set(prepared: Prepared, load: LoadCase, p: Vector, stop: Stop) -> NDArray[np.bool_]:
    if not prepared.assembly.K.dense:
        return augmented.contact_set(prepared, load, p > 0, stop)
    return contact_set(prepared.Q, p, stop=stop)
