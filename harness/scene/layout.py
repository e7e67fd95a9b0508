"""The places of parts and contacts in x and λ, and what a picture of a scene marks."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.forms.assembly import Assembly, Vector
from problems.model.effect import ForceEffect
from problems.model.scene import JointScene, Scene


def layout(scene: Scene, assembly: Assembly) -> dict[str, Any]:
    """The ranges of parts in x and of pairs in λ, and what a picture marks."""
    if not isinstance(scene, JointScene):
        spans = zip(assembly.parts, assembly.K.slices, strict=True)
        nodes = assembly.nodes if assembly.nodes is not None else np.zeros((assembly.n, 2))
        bare: dict[str, Any] = {"clamped": [], "supports": []}
        parts = [
            {"name": name, "start": s.start, "stop": s.stop, "outline": _extent(nodes[s]), **bare}
            for name, s in spans
        ]
        return {
            "parts": parts,
            "pairs": [{"pair": ["all parts"], "start": 0, "stop": assembly.m}] if assembly.m else [],
            "marks": {},
        }
    joint = scene.joint
    size = joint.node_count
    parts = []
    for k, part in enumerate(joint.part):
        plate = joint.plate(part)
        held = [e.held_points for e in scene.stiffness_effects if e.part == part.name]
        parts.append(
            {
                "name": part.name,
                "start": k * size,
                "stop": (k + 1) * size,
                "outline": [0.0, joint.junction.length, plate.y[0], plate.y[-1]],
                "clamped": part.clamped,
                "supports": [point for points in held for point in points],
            }
        )
    pairs = [{"pair": pair, "start": k * size, "stop": (k + 1) * size} for k, pair in enumerate(joint.pairs)]
    marks: dict[str, list[list[float]]] = {}
    for effect in scene.effects_of(ForceEffect):
        if len(points := effect.marks(joint)):
            marks.setdefault(effect.kind, []).extend(points.tolist())
    return {"parts": parts, "pairs": pairs, "marks": marks}


def _extent(nodes: Vector) -> list[float]:
    """The smallest and largest x, then y, of some nodes."""
    return np.column_stack([nodes.min(axis=0), nodes.max(axis=0)]).ravel().tolist()
