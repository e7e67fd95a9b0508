"""From a scene to its matrices and its loads.

The parts' own matrices come from build.py. A scene that names springs between parts, or loads beyond the
junction, gets these added here; of any other scene not a bit is touched.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import LoadCase, Prepared
from problems.model.effect import PartLoadEffect, TieEffect

from . import build
from .scene import Scene


def prepared(scene: Scene, progress: build.Progress = lambda text, fraction: None) -> Prepared:
    """K, A, the Cholesky factors of K and Q of a scene: memory-mapped from the cache, or built.

    Raises InputError where K is not positive definite or worse conditioned than 1e14.
    """
    base = build.prepared(scene, progress)
    ties = [effect for effect in scene.effects if isinstance(effect, TieEffect)]
    if scene.joint is None or not ties:
        return base
    from problems.condensation.springs import tied

    springs = [effect.springs(scene.joint) for effect in ties]
    T = sp.csc_array(sp.hstack([T for T, _ in springs]))
    return tied(base, scene, T, np.concatenate([k for _, k in springs]), progress)


def load_case(scene: Scene, prepared: Prepared) -> LoadCase:
    """f and g of a scene: the sum of its effects' terms."""
    load = build.load_case(scene, prepared)
    beyond = [effect for effect in scene.effects if isinstance(effect, PartLoadEffect)]
    if scene.joint is None or not beyond:
        return load
    from problems.condensation.condensed_load import condensed_load

    f = load.f
    for effect in beyond:
        f[scene.joint.unknowns(effect.part)] += condensed_load(effect, scene, scene.joint)
    return LoadCase(f, load.g)
