"""A clamped plate, and one on four ever softer springs; at full size the wing panel on ever softer supports.

cond(K) grows with their compliance, at full size to 3e11: beyond, λmin(K) can no longer be proven there, so
that no answer could be judged.
"""

from __future__ import annotations

from functools import partial

from problems.manufactured.ladder import Ladder, Scene
from problems.manufactured.plates import CLAMPED, FREE, plates, wing_panel

PARTS = {"on springs": FREE, "clamped": CLAMPED}
POINTS = ((100.0, 0.0), (900.0, 0.0), (100.0, 300.0), (900.0, 300.0))


def _rung(stiffness: float) -> Scene:
    springs = {"kind": "supports", "part": "on springs", "points": POINTS, "stiffness_per_point": stiffness}
    return plates(f"A plate on springs of {stiffness:g} N/mm", PARTS, springs)


def _full_size(n: int, stiffness: float) -> Scene:
    title = f"A wing panel on supports of {stiffness:g} N/mm"
    return wing_panel(title, n, stiffness_per_point=stiffness)


RUNGS: Ladder = {
    f"{stiffness:.0e}": partial(_rung, stiffness) for stiffness in (1e6, 1e3, 1.0, 1e-2, 1e-4, 1e-6)
}
FULL_SIZE: Ladder = {
    f"{n}-{stiffness:.0e}": partial(_full_size, n, stiffness)
    for n, stiffness in ((4386, 1e3), (4386, 1.0), (4386, 1e-1), (4386, 1e-2), (4386, 2e-3), (11308, 1e-1))
}
