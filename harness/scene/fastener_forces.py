"""The force in each fastener of an answer: a preload as given, a spring's from its stretch.

An installed fastener is a spring of stiffness k along t = e_a − e_b, set at the approach a: it pulls its
parts together with k (a − tᵀx), N, and pushes them apart where that is negative.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from problems.forms.assembly import Vector
from problems.model.effect import Effect, SpringEffect
from problems.model.joint import Joint
from problems.model.scene import JointScene, Scene

PRELOADS = ("preload", "clamping_force")  # keys of the effects that press at points


def fastener_forces(scene: Scene, x: Vector) -> list[dict[str, Any]]:
    """One entry per fastener and contact: kind, pair, x and y in mm, force_N. x : (n,) mm."""
    if not isinstance(scene, JointScene):
        return []
    return [entry for effect in scene.effects for entry in _of_effect(effect, scene.joint, x)]


def _of_effect(effect: Effect, joint: Joint, x: Vector) -> Iterator[dict[str, Any]]:
    if isinstance(effect, SpringEffect):
        T, k = effect.springs(joint)
        forces = k * (getattr(effect, "approach", 0.0) - T.T @ x)
        names = [part.name for part in joint.part]
        for column, force in enumerate(forces):
            own = slice(T.indptr[column], T.indptr[column + 1])
            ends = T.indices[own][np.argsort(-T.data[own])]  # e_a, then −e_b
            tied = [names[end // joint.node_count] for end in ends]
            yield _entry(effect, tied, joint.nodes[ends[0] % joint.node_count], force)
        return
    given: Any = effect  # its kind is not imported here, so that no other is
    for force in (getattr(effect, name) for name in PRELOADS if hasattr(effect, name)):
        for pair in given.pairs(joint):
            for node in given.nearest_nodes(joint):
                yield _entry(effect, list(pair), joint.nodes[node], force)


def _entry(effect: Effect, pair: list[str], place: Vector, force: float) -> dict[str, Any]:
    x, y = place
    return {"kind": effect.kind, "pair": pair, "x": float(x), "y": float(y), "force_N": float(force)}
