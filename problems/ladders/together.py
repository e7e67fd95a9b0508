"""Combined: cond(K) grows, a quarter of the contacts are weakly active, each contact has its own unit."""

from __future__ import annotations

from functools import partial

import numpy as np

from problems.manufactured.exact import two_parts
from problems.manufactured.ladder import Ladder, Scene, matrices

from .units import rescaled


def _rung(condition: float) -> Scene:
    made = two_parts(64, condition, seed=14, weak=0.25)
    C = np.exp2(np.random.default_rng(15).integers(-5, 6, made.assembly.m))
    title = f"Two parts, cond(K) = {condition:g}, contacts without a force, each in its own unit"
    return matrices(title, rescaled(made, 1.0, C, 1.0))


RUNGS: Ladder = {f"{condition:.0e}": partial(_rung, condition) for condition in (1e4, 1e6, 1e8, 1e10, 1e12)}
