"""A clamped plate, and one on four ever softer springs."""

from __future__ import annotations

from functools import partial

from problems.manufactured.ladder import Ladder, Rung, plates

from .parts import CLAMPED_PART, FASTENERS, GAP, JUNCTION

POINTS = ((100.0, 0.0), (900.0, 0.0), (100.0, 300.0), (900.0, 300.0))


def _rung(stiffness: float) -> Rung:
    parts = [{"name": "on springs", "thickness": 6.0}, CLAMPED_PART | {"name": "clamped"}]
    springs = {"kind": "supports", "part": "on springs", "points": POINTS, "stiffness_per_point": stiffness}
    title = f"A plate on springs of {stiffness:g} N/mm"
    return plates(title, {"junction": JUNCTION, "part": parts}, springs, GAP, FASTENERS)


STIFFNESSES = (1e6, 1e3, 1.0, 1e-2, 1e-4, 1e-6)  # N/mm

RUNGS: Ladder = {f"{stiffness:.0e}": partial(_rung, stiffness) for stiffness in STIFFNESSES}
