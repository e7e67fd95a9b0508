"""The force in each fastener of an answer.

An installed fastener is a spring of stiffness k along t = w_a − w_b, set at the approach a: it pulls its
parts together with preload + k (a − tᵀx), N, and pushes them apart where that is negative. If x is off by at
most e, and t has q entries, the force as computed is off by at most

    k (‖t‖₁ e + γ_{q+4} (|a| + |t|ᵀ|x|)) + γ_4 preload:

a term of tᵀx takes part in q roundings, of its product and of sums, and in those of the difference, of the
product with k and of the sum with the preload.
"""

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from problems.forms.assembly import Vector
from problems.stiffness import SAFE, gamma

from .effect import SpringEffect
from .positions import FORCES, Positions
from .scene import JointScene, Scene
from .springs import Springs


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


def force_error(springs: Springs, scene: JointScene, x: Vector, error_mm: float) -> float:
    """How far the forces in the springs of a scene are off at most, N; 0 without springs.

    springs : those of the scene. x : (n,) mm, off by error_mm at most.
    """
    if not springs:
        return 0.0
    if not np.isfinite(error_mm):
        return np.inf
    effects, size = list(scene.effects_of(SpringEffect)), abs(springs.T)
    a, preload = (
        max(float(np.max(np.abs(getattr(effect, key)), initial=0.0)) for effect in effects)
        for key in ("approach", "preload")
    )
    rounding = gamma(np.diff(size.indptr) + 4) * (a + size.T @ abs(x))
    off = springs.k * (size.sum(axis=0) * error_mm + rounding)
    return float(SAFE * (off.max() + gamma(4) * preload))
