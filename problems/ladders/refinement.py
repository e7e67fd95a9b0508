"""Two plates of fixed size with ever more nodes along x: cond(K) grows with the fourth power."""

from __future__ import annotations

from functools import partial

from problems.manufactured.ladder import Ladder
from problems.manufactured.plates import CLAMPED, plates

PARTS = {"wing": CLAMPED, "fragment": CLAMPED}

RUNGS: Ladder = {
    f"{nodes:02d}": partial(plates, f"Two plates, {nodes} × 3 nodes", PARTS, nodes=(nodes, 3))
    for nodes in (8, 16, 32, 64)
}
