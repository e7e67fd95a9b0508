"""The reference that answers are compared with: forces from anywhere, refined, with a proven bound.

Nothing is searched for here. Candidates are the problem's exact answer, if it was made from one, forces that
the caller has, and the answers of the in-house methods in turn; each is refined and its error bounded from K,
A, f and g alone (see `proof`), until a bound is at most a tenth of the limit. The bound does not depend on
where the forces came from; the best one is kept.
"""

import time
from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np

from harness.solving.session import candidates
from problems import storage
from problems.forms.assembly import LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.model.scene import ManufacturedScene, Scene
from problems.storage import fingerprint

from .balanced_units import smallest_eigenvalue
from .judge import LIMIT_MM, REFERENCE_SHARE, Reference
from .proof import Proof, Proven

#: What forces come from, and λ (m,) in N.
Candidate = tuple[str, Vector]
STOPPED = "no further method was tried"
UNPROVEN = "could not be proven"
ESTIMATED = 0.5  # of an estimate of λmin that is no smaller


def default_limit_s(m: int) -> float:
    """Seconds after which no further candidate is tried: 60 per thousand contacts, at least 60."""
    return 0.06 * max(m, 1000)


def reference_of(
    scene: Scene,
    prepared: Prepared,
    load: LoadCase,
    limit_s: float | None = None,
    given: Sequence[Candidate] = (),
) -> Reference:
    """The reference of a scene: the answer that it was made from, if any, else that of its load case."""
    made = scene.made if isinstance(scene, ManufacturedScene) else None
    if made is not None and made.x is not None and made.lam is not None:
        return Reference(
            made.x.copy(), made.lam.copy(), made.lam > 0, 0.0, "chosen, exact", made.unit_mm, made.gap_unit_mm
        )
    return reference(prepared, load, limit_s, given)


def reference(
    prepared: Prepared, load: LoadCase, limit_s: float | None = None, given: Sequence[Candidate] = ()
) -> Reference:
    """The reference of a load case, from the cache if it was proven before for these matrices."""
    if prepared.key is None:
        return best_of_candidates(prepared, load, limit_s, given)
    key = storage.digest("reference", prepared.key, load.f.tobytes(), load.g.tobytes(), _code())
    stored = storage.load(key)
    if stored is not None:
        arrays, facts = stored
        x, lam = (np.array(arrays[name]) for name in ("x", "lam"))
        return Reference(x, lam, lam > 0, facts["bound_mm"], facts["route"])
    found = best_of_candidates(prepared, load, limit_s, given)
    if found.bound_mm <= REFERENCE_SHARE * LIMIT_MM:  # else another candidate may prove more
        arrays = {"x": found.x, "lam": found.lam}
        facts = {"bound_mm": found.bound_mm, "route": found.route}
        storage.load_or_make(key, lambda: (arrays, facts))  # unless another process was faster
    return found


def best_of_candidates(
    prepared: Prepared, load: LoadCase, limit_s: float | None = None, given: Sequence[Candidate] = ()
) -> Reference:
    """given : tried first. limit_s : after it no further candidate is tried."""
    limit_s = default_limit_s(prepared.assembly.m) if limit_s is None else limit_s
    proof, end = proof_of(prepared), time.monotonic() + limit_s
    best: Proven | None = None
    route = stopped = ""
    for name, lam in chain(given, candidates(prepared, load)):
        (found,) = proof.proven([load], [lam])
        if best is None or found.bound_mm < best.bound_mm:
            best, route = found, name
        if best.bound_mm <= REFERENCE_SHARE * LIMIT_MM:
            break
        if time.monotonic() > end:
            stopped = f", {STOPPED} after {limit_s:g} s"
            break
    if best is None:  # no method gave an answer
        (best,), route = proof.proven([load], [np.zeros(prepared.assembly.m)]), "no forces"
    said = "" if np.isfinite(best.bound_mm) else f"{UNPROVEN}: "
    return Reference(best.x.hi, best.lam.hi, best.active, best.bound_mm, f"{said}{route}{stopped}")


def proof_of(prepared: Prepared) -> Proof:
    """What the load cases of an assembly share."""
    return Proof(prepared, proven_lambda_min(prepared), partial(_remembered, prepared))


def proven_lambda_min(prepared: Prepared) -> float:
    """κ ≤ λmin(DKD) in balanced units, from the cache if it was proven before for this assembly."""
    K = prepared.assembly.K

    def proven() -> float:
        return smallest_eigenvalue(K, K.units, [ESTIMATED * about for about in K.least_eigenvalues(K.units)])

    return _remembered(prepared, "lambda_min", proven)


def _remembered(prepared: Prepared, name: str, make: Callable[[], float]) -> float:
    """A figure of an assembly that takes a while, from the cache."""
    if prepared.key is None:
        return make()
    _, facts = storage.load_or_make(
        storage.digest(name, prepared.key, _code()), lambda: ({}, {"value": repr(make())})
    )
    return float(facts["value"])


def _code() -> str:
    """The fingerprint of the code for references: those of other code are recomputed."""
    return fingerprint([Path(__file__)], within=["harness/verification", "problems/stiffness"])
