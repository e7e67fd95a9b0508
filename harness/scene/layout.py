"""What the record of an answer says of its scene: where parts and contacts are in x and λ, what a picture
marks, and the force in each fastener.

An installed fastener is a spring of stiffness k along t = e_a − e_b, set at the approach a: it pulls its
parts together with k (a − tᵀx), N, and pushes them apart where that is negative.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from problems.forms.assembly import Assembly, Vector
from problems.model.effect import Effect, ForceEffect, SpringEffect
from problems.model.joint import Joint
from problems.model.scene import JointScene, Scene

PRELOADS = ("preload", "clamping_force")  # keys of the effects that press at points


def layout(scene: Scene, assembly: Assembly) -> dict[str, Any]:
    """The ranges of parts in x and of pairs in λ, and what a picture marks."""
    if not isinstance(scene, JointScene):
        nodes = assembly.nodes if assembly.nodes is not None else np.zeros((assembly.n, 2))
        spans = zip(assembly.parts, assembly.K.slices, strict=True)
        parts = [_part(name, s.start, s.stop, _extent(nodes[s])) for name, s in spans]
        pairs = [{"pair": ["all parts"], "start": 0, "stop": assembly.m}] if assembly.m else []
        return {"parts": parts, "pairs": pairs, "marks": {}}
    joint, size, parts = scene.joint, scene.joint.node_count, []
    for k, part in enumerate(joint.part):
        y = joint.plate(part).y
        outline = [0.0, joint.junction.length, y[0], y[-1]]
        held = [point for e in scene.stiffness_effects if e.part == part.name for point in e.held_points]
        parts.append(_part(part.name, k * size, (k + 1) * size, outline, part.clamped, held))
    pairs = [{"pair": pair, "start": k * size, "stop": (k + 1) * size} for k, pair in enumerate(joint.pairs)]
    marks: dict[str, list[list[float]]] = {}
    for effect in scene.effects_of(ForceEffect):
        if len(points := effect.marks(joint)):
            marks.setdefault(effect.kind, []).extend(points.tolist())
    return {"parts": parts, "pairs": pairs, "marks": marks}


def _part(
    name: str, start: int, stop: int, outline: list[float], clamped: Sequence[str] = (), supports: Any = ()
) -> dict[str, Any]:
    ends = {"name": name, "start": start, "stop": stop, "outline": outline}
    return ends | {"clamped": list(clamped), "supports": list(supports)}


def _extent(nodes: Vector) -> list[float]:
    """The smallest and largest x, then y, of some nodes."""
    return np.column_stack([nodes.min(axis=0), nodes.max(axis=0)]).ravel().tolist()


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
