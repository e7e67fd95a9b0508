"""From a scene to the dense forms' matrices and loads. Each stage is computed when first needed, and cached:

scene → condensed parts → springs between them → Assembly (K, A) → factors of K → Q
scene → LoadCase (f, g), loads beyond the junction condensed
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Assembly, LoadCase, Vector
from problems.forms.prepared import Prepared
from problems.forms.problem import Progress
from problems.forms.stages import CachedStages, indefinite
from problems.model.effect import TieEffect
from problems.model.part_load import PartLoadEffect
from problems.model.scene import JointScene, MadeScene, MatricesScene, Scene
from problems.stiffness.block import NotPositiveDefinite
from problems.stiffness.operator import Stiffness
from problems.storage import cache
from problems.storage.fingerprint import fingerprint

from .condensed_part import condensed_part, part_key


def prepared(scene: Scene, progress: Progress) -> Prepared:
    """K and A of a scene, memory-mapped from the cache or computed now; factors and Q when first needed.

    Raises InputError if a part can move freely, or if a user's matrices are invalid.
    """
    stages = _stages(scene, progress)
    return Prepared(stages.assembly, stages)


def _stages(scene: Scene, progress: Progress) -> CachedStages:
    match scene:
        case JointScene():
            return _condensed(scene, progress)
        case MatricesScene():
            assembly, _, seconds, key = _own(scene)
            return CachedStages(assembly, key, {"condensation": seconds}, scene.source_of, True, progress)
        case MadeScene():
            made = scene.made.assembly
            K = made.K.as_dense()
            names = made.parts if K is made.K else tuple(f"part {k + 1}" for k in range(len(K.blocks)))
            assembly = replace(made, K=K, parts=names)
            no_time = {"condensation": 0.0}
            return CachedStages(assembly, scene.assembly_key, no_time, scene.source_of, True, progress)
    raise TypeError(type(scene).__name__)


def built(scene: JointScene) -> bool:
    """Whether every matrix of a scene is in the cache; computes nothing."""
    parts = [part_key(scene.joint, part, scene.stiffness_effects) for part in scene.joint.part]
    tied = [_springs(scene, cache.digest(parts))[2]] if any(scene.effects_of(TieEffect)) else []
    return None not in map(cache.load, [*parts, *tied]) and _stages(scene, lambda text, fraction: None).built


def load_case(scene: Scene) -> LoadCase:
    """f and g of a scene: the sum of its effects' terms, or the user's own."""
    match scene:
        case JointScene():
            return _load_of_effects(scene)
        case MatricesScene():
            return _own(scene)[1]
        case MadeScene():
            return scene.made.load
    raise TypeError(type(scene).__name__)


def _condensed(scene: JointScene, progress: Progress) -> CachedStages:
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
    names = tuple(part.name for part in joint.part)
    assembly = Assembly(Stiffness.of(*blocks), joint.contact_matrix(), nodes, names)
    key, steps = cache.digest(keys), {"condensation": sum(seconds.values())}
    if any(scene.effects_of(TieEffect)):
        assembly, key, steps["ties"] = _tied(scene, assembly, key, progress)
    return CachedStages(assembly, key, steps, scene.source_of, False, progress)


def _tied(
    scene: JointScene, untied: Assembly, untied_key: str, progress: Progress
) -> tuple[Assembly, str, float]:
    """The assembly with the scene's springs between parts, the key of its K, and the seconds."""
    from . import springs  # imported only for springs

    T, k, key = _springs(scene, untied_key)

    def made() -> cache.Entry:
        progress("springs between the parts", 0.0)
        start = time.perf_counter()
        blocks, names = springs.with_springs(untied.K, untied.parts, T, k)
        facts = {"parts": names, "seconds": time.perf_counter() - start}
        return {f"K{i}": K for i, K in enumerate(blocks)}, facts

    arrays, facts = cache.load_or_make(key, made)
    names = tuple(facts["parts"])
    K = Stiffness.of(*(arrays[f"K{i}"] for i in range(len(names))))
    return Assembly(K, untied.A, untied.nodes, names), key, facts["seconds"]


def _springs(scene: JointScene, untied_key: str) -> tuple[sp.csc_array, Vector, str]:
    """Directions T (n, r) and stiffnesses k (r,) of the springs, and the key of K with them."""
    from . import springs

    pairs = [effect.springs(scene.joint) for effect in scene.effects_of(TieEffect)]
    T = sp.csc_array(sp.hstack([T for T, _ in pairs]))
    k = np.concatenate([k for _, k in pairs])
    code = fingerprint([Path(springs.__file__)])
    return T, k, cache.digest("springs", untied_key, T.indices.tolist(), T.data.tolist(), k.tolist(), code)


def _own(scene: MatricesScene) -> tuple[Assembly, LoadCase, float, str]:
    from problems.input.stored_matrices import stored_matrices  # only for own matrices

    return stored_matrices(dict(scene.files), scene.assembly_key, sparse=False)


def _load_of_effects(scene: JointScene) -> LoadCase:
    joint, (f, g) = scene.joint, scene.junction_load()
    for effect in scene.effects_of(PartLoadEffect):
        from .condensed_load import condensed_load  # imported only for such loads

        f[joint.unknowns(effect.part)] += condensed_load(effect, joint, scene.stiffness_effects)
    return LoadCase(f, g)
