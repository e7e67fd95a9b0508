"""Two plates of fixed size with ever more nodes along x: cond(K) grows with the fourth power."""

from __future__ import annotations

from functools import partial

from problems.manufactured.ladder import Ladder, Rung, plates

from .parts import CLAMPED_PART, FASTENERS, GAP, JUNCTION


def _rung(nodes: int) -> Rung:
    parts = [CLAMPED_PART | {"name": "wing"}, CLAMPED_PART | {"name": "fragment"}]
    joint = {"junction": JUNCTION | {"nodes": (nodes, 3)}, "part": parts}
    return plates(f"Two plates, {nodes} × 3 nodes", joint, GAP, FASTENERS)


RUNGS: Ladder = {f"{nodes:02d}": partial(_rung, nodes) for nodes in (8, 16, 32, 64)}
