"""The places of parts and contacts in x and λ, and what a picture of a scene marks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from problems.forms.assembly import Assembly, Vector
from problems.model.effect import ForceEffect
from problems.model.scene import JointScene, Scene


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
