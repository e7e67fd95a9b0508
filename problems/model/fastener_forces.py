"""The force in each fastener of an answer.

An installed fastener is a spring of stiffness k along t = w_a − w_b, set at the approach a: it pulls its
parts together with preload + k (a − tᵀx), N, and pushes them apart where that is negative. If x is off by at
most e, the force is by at most k ‖t‖₁ e.
"""

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from problems.forms.assembly import Vector

from .effect import SpringEffect
from .positions import FORCES, Positions
from .scene import JointScene, Scene


def fastener_forces(scene: Scene, x: Vector) -> Iterator[dict[str, Any]]:
    """One entry per fastener and contact: kind, pair, x and y in mm, force_N. x : (n,) mm."""
    if not isinstance(scene, JointScene):
        return
    for effect in scene.effects:
        joint, preloads = scene.joint, [getattr(effect, key) for key in FORCES if hasattr(effect, key)]
        if isinstance(effect, SpringEffect):
            pairs, forces = effect.tied(joint), effect.tension(joint, x).tolist()
        elif preloads and isinstance(effect, Positions):
            pairs = list(effect.pairs(joint))
            forces = np.resize(preloads, len(pairs) * effect.element_count(joint)).tolist()
        else:
            continue
        places = product(pairs, effect.marks(joint).tolist())
        for (pair, (at_x, at_y)), force in zip(places, forces, strict=False):
            yield {"kind": effect.kind, "pair": list(pair), "x": at_x, "y": at_y, "force_N": force}


def force_error_per_mm(scene: Scene) -> float:
    """max k ‖t‖₁, N/mm: how far forces are off for each mm that x is; 0 without springs."""
    if not isinstance(scene, JointScene):
        return 0.0
    springs = (effect.springs(scene.joint) for effect in scene.effects_of(SpringEffect))
    return max((float((k * abs(T).sum(axis=0)).max()) for T, k in springs), default=0.0)
