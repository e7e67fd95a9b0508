"""Contacts in units of their own: columns of A and gaps multiplied by 2^−k to 2^k, so that 1 mm is 2^±k in g.

What a solver's tolerance means then differs from contact to contact; the answer in mm and N does not.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from problems.manufactured.exact import two_parts
from problems.manufactured.ladder import Ladder, Scene, matrices

from .units import rescaled


def _rung(k: int) -> Scene:
    C = np.exp2(np.random.default_rng(9).integers(-k, k + 1, 64))
    title = f"Two parts, each contact in a unit of its own, 2^−{k} to 2^{k} mm"
    return matrices(title, rescaled(two_parts(64, 1e4, seed=9), 1.0, C, 1.0))


RUNGS: Ladder = {f"{k:02d}-bits": partial(_rung, k) for k in (5, 10, 20, 30, 40)}
