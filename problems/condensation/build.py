"""From a scene to the dense forms' matrices and loads. Each stage is computed when first needed, and cached:

scene → condensed parts → springs between them → Assembly (K, A) → factors of K → Q
scene → LoadCase (f, g), loads beyond the junction condensed
"""

from __future__ import annotations

import time
from dataclasses import fields
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from problems.forms.alteration import Alteration
from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.stages import Progress, Stored, indefinite
from problems.input import user_matrices
from problems.model.effect import ForceEffect, GapEffect, TieEffect
from problems.model.part_load import PartLoadEffect
from problems.model.scene import JointScene, MadeScene, MatricesScene, Scene
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from .condense import NotPositiveDefinite
from .condensed_part import condensed_part, part_key

ALTERED = tuple(field.name for field in fields(Alteration))


def prepared(scene: Scene, progress: Progress) -> Stored:
    """K and A of a scene, memory-mapped from the cache or computed now; factors and Q when first needed.

    Raises InputError if a part can move freely, or if a user's matrices are invalid.
    """
    match scene:
        case JointScene():
            return _condensed(scene, progress)
        case MatricesScene():
            (arrays, facts), key = _user_matrices(scene)
            columns = tuple(arrays[f"A_{name}"] for name in ("data", "indices", "indptr"))
            A = sp.csc_array(columns, shape=facts["shape"])
            blocks = tuple(arrays[f"K{k}"] for k in range(len(facts["parts"])))
            altered = (
                Alteration(*(arrays[f"altered_{name}"] for name in ALTERED)) if facts["altered"] else None
            )
            assembly = Assembly(blocks, A, arrays.get("nodes"), tuple(facts["parts"]), altered)
            return Stored(assembly, key, facts["seconds"], scene.source_of, True, progress)
        case MadeScene():
            no_time = {"condensation": 0.0}
            return Stored(scene.made.assembly, scene.assembly_key, no_time, scene.source_of, True, progress)
    raise TypeError(type(scene).__name__)


def built(scene: JointScene) -> bool:
    """Whether every matrix of a scene is in the cache; computes nothing."""
    parts = [part_key(scene.joint, part, scene.stiffness_effects) for part in scene.joint.part]
    tied = [_springs(scene, cache.digest(parts))[2]] if any(scene.effects_of(TieEffect)) else []
    return None not in map(cache.load, [*parts, *tied]) and prepared(scene, lambda text, fraction: None).built


def load_case(scene: Scene) -> LoadCase:
    """f and g of a scene: the sum of its effects' terms, or the user's own."""
    match scene:
        case JointScene():
            return _load_of_effects(scene)
        case MatricesScene():
            (arrays, _), _ = _user_matrices(scene)
            return LoadCase(np.array(arrays["f"]), np.array(arrays["g"]))
        case MadeScene():
            return scene.made.load
    raise TypeError(type(scene).__name__)


def _condensed(scene: JointScene, progress: Progress) -> Stored:
    joint, effects = scene.joint, scene.stiffness_effects
    keys = [part_key(joint, part, effects) for part in joint.part]
    blocks, seconds = [], {}
    for part, key in zip(joint.part, keys, strict=True):
        try:
            K, seconds[key] = condensed_part(joint, part, effects, progress)
        except NotPositiveDefinite as error:
            raise indefinite(scene.source_of("K"), f"part.{part.name}", str(error)) from error
        blocks.append(K)
    nodes = np.tile(joint.nodes, (len(joint.part), 1))
    assembly = Assembly(tuple(blocks), joint.contact_matrix(), nodes, tuple(part.name for part in joint.part))
    key, steps = cache.digest(keys), {"condensation": sum(seconds.values())}
    if any(scene.effects_of(TieEffect)):
        assembly, key, steps["ties"] = _tied(scene, assembly, key, progress)
    return Stored(assembly, key, steps, scene.source_of, False, progress)


def _tied(
    scene: JointScene, untied: Assembly, untied_key: str, progress: Progress
) -> tuple[Assembly, str, float]:
    """The assembly with the scene's springs between parts, the key of its K, and the seconds."""
    from . import springs  # imported only for springs

    T, k, key = _springs(scene, untied_key)

    def made() -> cache.Entry:
        progress("springs between the parts", 0.0)
        start = time.perf_counter()
        blocks, names = springs.with_springs(untied.blocks, untied.parts, T, k)
        facts = {"parts": names, "seconds": time.perf_counter() - start}
        return {f"K{i}": K for i, K in enumerate(blocks)}, facts

    arrays, facts = cache.load_or_make(key, made)
    names = tuple(facts["parts"])
    blocks = tuple(arrays[f"K{i}"] for i in range(len(names)))
    return Assembly(blocks, untied.A, untied.nodes, names), key, facts["seconds"]


def _springs(scene: JointScene, untied_key: str) -> tuple[sp.csc_array, Vector, str]:
    """Directions T (n, r) and stiffnesses k (r,) of the springs, and the key of K with them."""
    from . import springs

    pairs = [effect.springs(scene.joint) for effect in scene.effects_of(TieEffect)]
    T = sp.csc_array(sp.hstack([T for T, _ in pairs]))
    k = np.concatenate([k for _, k in pairs])
    code = fingerprint([Path(springs.__file__)])
    return T, k, cache.digest("springs", untied_key, T.indices.tolist(), T.data.tolist(), k.tolist(), code)


def _user_matrices(scene: MatricesScene) -> tuple[cache.Entry, str]:
    """A user's K, A, f, g, read and checked once, and their key."""
    key = cache.digest("own", scene.assembly_key, fingerprint([Path(user_matrices.__file__)]))

    def made() -> cache.Entry:
        start = time.perf_counter()
        assembly, load = user_matrices.read_matrices(dict(scene.files))
        A = assembly.A
        arrays = {"A_data": A.data, "A_indices": A.indices, "A_indptr": A.indptr, "f": load.f, "g": load.g}
        if assembly.nodes is not None:
            arrays["nodes"] = assembly.nodes
        arrays |= {f"K{k}": K for k, K in enumerate(assembly.blocks)}
        if assembly.altered:
            arrays |= {f"altered_{name}": getattr(assembly.altered, name) for name in ALTERED}
        steps = {"condensation": time.perf_counter() - start}
        facts = {
            "parts": assembly.parts,
            "shape": A.shape,
            "altered": bool(assembly.altered),
            "seconds": steps,
        }
        return arrays, facts

    return cache.load_or_make(key, made), key


def _load_of_effects(scene: JointScene) -> LoadCase:
    joint = scene.joint
    n, m = joint.size
    f, g = np.zeros(n), np.zeros(m)
    for effect in scene.effects:
        if isinstance(effect, ForceEffect):
            f += effect.force(joint)
        elif isinstance(effect, GapEffect):
            g += effect.gap(joint)
    for effect in scene.effects_of(PartLoadEffect):
        from .condensed_load import condensed_load  # imported only for such loads

        f[joint.unknowns(effect.part)] += condensed_load(effect, joint, scene.stiffness_effects)
    return LoadCase(f, g)
