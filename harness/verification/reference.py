"""The reference that answers are compared with: forces from anywhere, refined, with a proven bound.

The reference of a problem that was made from its exact answer is that answer. Else candidates are tried:
forces that the caller has, then the answers of the in-house methods in turn. Each is refined and its error
bounded from K, A, f and g alone (proof.py), until a bound is at most a tenth of the limit; the best one is
kept. The bound does not depend on where the forces came from.
"""

import time
from collections.abc import Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from harness.solving.solver_session import candidate_forces
from problems import storage
from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.model.scene import ManufacturedScene, Scene
from problems.storage import fingerprint

from .balanced_units import smallest_eigenvalue
from .judge import LIMIT_MM, REFERENCE_SHARE, Reference
from .proof import Proof, Proven, cached_figure

#: The name of a method, and its λ (m,) in N.
Candidate = tuple[str, Vector]
STOPPED = "no further method was tried"
UNPROVEN = "could not be proven"
ESTIMATED = 0.5  # share of an estimate of λmin, which is not below λmin


def default_limit_s(m: int) -> float:
    """Seconds after which no further candidate is tried: 60 per thousand contacts, at least 60."""
    return 0.06 * max(m, 1000)


def reference_of(
    scene: Scene,
    prepared: Prepared,
    load: LoadCase,
    limit_s: float | None = None,
    first: Sequence[Candidate] = (),
) -> Reference:
    """The reference of a scene: the answer that it was made from, if any, else that of its load case.

    first : candidates that are tried before the in-house methods. limit_s : see `best_of_candidates`.
    """
    made = scene.made if isinstance(scene, ManufacturedScene) else None
    if made is not None and made.x is not None and made.lam is not None:
        x, lam, units = made.x.copy(), made.lam.copy(), (made.unit_mm, made.gap_unit_mm)
        return Reference(x, lam, lam > 0, 0.0, "chosen, exact", *units)
    return reference(prepared, load, limit_s, first)


def reference(
    prepared: Prepared, load: LoadCase, limit_s: float | None = None, first: Sequence[Candidate] = ()
) -> Reference:
    """The reference of a load case, from the cache if it was proven before for these matrices."""
    if prepared.key is None:
        return best_of_candidates(prepared, load, limit_s, first)
    code = fingerprint([Path(__file__)], within=["harness/verification", "problems/stiffness"])
    key = storage.digest("reference", prepared.key, load.f.tobytes(), load.g.tobytes(), code)
    stored = storage.load(key)
    if stored is not None:
        arrays, facts = stored
        x, lam = (np.array(arrays[name]) for name in ("x", "lam"))
        if facts["content"] == storage.digest(x.tobytes(), lam.tobytes()):  # long files are checked here
            return Reference(x, lam, lam > 0, facts["bound_mm"], facts["route"])
    best = best_of_candidates(prepared, load, limit_s, first)
    if best.bound_mm <= REFERENCE_SHARE * LIMIT_MM:  # else another candidate may prove more
        arrays = {"x": best.x, "lam": best.lam}
        facts = {"bound_mm": best.bound_mm, "route": best.route}
        facts["content"] = storage.digest(best.x.tobytes(), best.lam.tobytes())
        storage.load_or_make(key, lambda: (arrays, facts))  # unless another process was faster
    return best


def best_of_candidates(
    prepared: Prepared, load: LoadCase, limit_s: float | None = None, first: Sequence[Candidate] = ()
) -> Reference:
    """The candidate with the smallest bound, refined.

    limit_s : seconds after which no further candidate is tried; by default see `default_limit_s`. first :
    candidates that are tried before the in-house methods.
    """
    limit_s = default_limit_s(prepared.assembly.m) if limit_s is None else limit_s
    proof, end = proof_of(prepared), time.monotonic() + limit_s
    best: Proven | None = None
    route = stopped = ""
    for name, lam in chain(first, candidate_forces(prepared, load)):
        (refined,) = proof.proven([load], [lam])
        if best is None or refined.bound_mm < best.bound_mm:
            best, route = refined, name
        if best.bound_mm <= REFERENCE_SHARE * LIMIT_MM:
            break
        if time.monotonic() > end:
            stopped = f", {STOPPED} after {limit_s:g} s"
            break
    if best is None:  # no method gave an answer
        (best,), route = proof.proven([load], [np.zeros(prepared.assembly.m)]), "no forces"
    unproven = "" if np.isfinite(best.bound_mm) else f"{UNPROVEN}: "
    return Reference(best.x.hi, best.lam.hi, best.active, best.bound_mm, f"{unproven}{route}{stopped}")


def proof_of(prepared: Prepared) -> Proof:
    """The proof for an assembly, with its κ."""
    return Proof(prepared, proven_lambda_min(prepared))


def proven_lambda_min(prepared: Prepared) -> float:
    """κ ≤ λmin(DKD) in balanced units, from the cache if it was proven before for this assembly."""
    K = prepared.assembly.K

    def proven() -> float:
        return smallest_eigenvalue(K, K.units, [ESTIMATED * about for about in K.least_eigenvalues(K.units)])

    return cached_figure(prepared, "lambda_min", proven)
