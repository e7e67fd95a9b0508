"""Stiffnesses, forces and lengths in ever smaller units, towards the smallest numbers of float64.

A normal number is at least 2⁻¹⁰²²; below it, digits are lost. K times 2ᵃ and x and g times 2ᵇ give f and λ
times 2ᵃ⁺ᵇ: as long as every digit fits, the same answer without rounding. An answer is judged in mm; where
lengths are 1e-300 mm, it only has to be a finite one.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from problems.forms.assembly import Assembly, LoadCase
from problems.manufactured.exact import exact_model, manufacture, spectrum
from problems.manufactured.ladder import Ladder, ManufacturedProblem, Rung
from problems.stiffness.operator import Stiffness

N = 64  # unknowns per part
CONDITION = 1e4
REFUSED = "use another unit of force"


def _rung(a: int, b: int, refused: str = "") -> Rung:
    d = spectrum(N, CONDITION)
    made = manufacture(exact_model(d, d), seed=19)
    title = f"Two parts, stiffness times {2.0**a:.0e}, lengths times {2.0**b:.0e}"
    return Rung(title, made=_scaled(made, 2.0**a, 2.0**b), refused=refused)


def _scaled(made: ManufacturedProblem, stiffness: float, length: float) -> ManufacturedProblem:
    assert made.x is not None
    assert made.lam is not None
    given = made.assembly
    blocks = [np.asfortranarray(block.matrix * stiffness) for block in given.K.blocks]
    load = LoadCase(made.load.f * stiffness * length, made.load.g * length)
    assembly = Assembly(Stiffness.of(*blocks), given.A, None, given.parts)
    return ManufacturedProblem(assembly, load, made.x * length, made.lam * stiffness * length)


RUNGS: Ladder = {
    **{f"K-{2.0**a:.0e}": partial(_rung, a, 0) for a in (-50, -100, -300, -600, -980)},
    f"K-{2.0**-1010:.0e}": partial(_rung, -1010, 0, REFUSED),
    **{f"g-{2.0**b:.0e}": partial(_rung, 0, b) for b in (-50, -300, -1000, -1050)},
    **{f"f-{2.0 ** (2 * k):.0e}": partial(_rung, k, k) for k in (-500, -520)},
}
