"""The force in each fastener of an answer.

An installed fastener is a spring of stiffness k along t = w_a − w_b, set at the approach a: it pulls its
parts together with preload + k (a − tᵀx), N, and pushes them apart where that is negative.
"""

from collections.abc import Iterator
from itertools import product
from typing import Any, cast

import numpy as np

from problems.forms.assembly import Vector
from problems.model.effect import SpringEffect
from problems.model.positions import FORCES
from problems.model.scene import JointScene, Scene


def fastener_forces(scene: Scene, x: Vector) -> Iterator[dict[str, Any]]:
    """One entry per fastener and contact: kind, pair, x and y in mm, force_N. x : (n,) mm."""
    if not isinstance(scene, JointScene):
        return
    for effect in scene.effects:
        joint, fastener = scene.joint, cast(Any, effect)  # its kind is not imported, so that no other is
        if isinstance(effect, SpringEffect):
            pairs, forces = effect.tied(joint), effect.tension(joint, x).tolist()
        elif preloads := [getattr(effect, name) for name in FORCES if hasattr(effect, name)]:
            pairs = fastener.pairs(joint)
            forces = np.resize(preloads, len(pairs) * effect.element_count(joint)).tolist()
        else:
            continue
        places = product(pairs, effect.marks(joint).tolist())
        for (pair, (at_x, at_y)), force in zip(places, forces, strict=False):
            yield {"kind": effect.kind, "pair": list(pair), "x": at_x, "y": at_y, "force_N": force}
