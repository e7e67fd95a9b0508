"""Combined: cond(K) grows, a quarter of the contacts are weakly active, each contact has its own unit."""

from __future__ import annotations

from functools import partial

import numpy as np

from problems.manufactured.exact import Shares, exact_model, manufacture, spectrum
from problems.manufactured.ladder import Ladder, Rung

from .units import rescaled

N = 64  # contacts


def _rung(condition: float) -> Rung:
    d = spectrum(N, condition)
    made = manufacture(exact_model(d, d), seed=14, shares=Shares(0.4, 0.25))
    C = np.exp2(np.random.default_rng(15).integers(-5, 6, N))
    title = f"Two parts, cond(K) = {condition:g}, contacts without a force, each in its own unit"
    return Rung(title, made=rescaled(made, 1.0, C, 1.0))


RUNGS: Ladder = {f"{condition:.0e}": partial(_rung, condition) for condition in (1e4, 1e6, 1e8, 1e10, 1e12)}
