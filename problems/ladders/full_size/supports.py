"""The wing panel on ever softer supports: cond(K) grows with their compliance.

It ends at 3e11: beyond, λmin(K) can no longer be proven at this size, so that no answer could be judged.
"""

from __future__ import annotations

from functools import partial

from problems.manufactured.ladder import Ladder, Rung, plates

from .thickness import FASTENERS, GAP, wing_fragment


def _rung(n: int, stiffness: float) -> Rung:
    joint, effects = wing_fragment(n)
    soft = {"stiffness_per_point": stiffness}
    held = [effect | (soft if effect["kind"] == "supports" else {}) for effect in effects]
    title = f"A wing panel on supports of {stiffness:g} N/mm, n = {n}"
    return plates(title, joint, *held, GAP, FASTENERS)


RUNGS: Ladder = {
    f"{n}-{stiffness:.0e}": partial(_rung, n, stiffness)
    for n, stiffness in ((4386, 1e3), (4386, 1.0), (4386, 1e-1), (4386, 1e-2), (4386, 2e-3), (11308, 1e-1))
}
