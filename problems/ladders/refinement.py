"""Two plates of one size with ever more nodes along it: cond(K) grows like the fourth power."""

from __future__ import annotations

from functools import partial

from problems.manufactured.ladder import Ladder, Rung, plates

from .parts import FASTENERS, GAP, HELD, JUNCTION


def _rung(nodes: int) -> Rung:
    parts = [HELD | {"name": "wing"}, HELD | {"name": "fragment"}]
    joint = {"junction": JUNCTION | {"nodes": (nodes, 3)}, "part": parts}
    return plates(f"Two plates, {nodes} × 3 nodes", joint, GAP, FASTENERS)


RUNGS: Ladder = {f"{nodes:02d}": partial(_rung, nodes) for nodes in (8, 16, 32, 64)}
