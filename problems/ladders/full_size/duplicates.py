"""Nearly dependent constraints at full size: 128 contacts duplicated, ever closer to the originals.

At 2⁻¹⁶ a pivot of Q would be within the rounding of 3184 contacts.
"""

from __future__ import annotations

from functools import partial

from problems.forms.manufactured_problem import DeferredProblem, ManufacturedProblem
from problems.ladders.duplicates import contacts
from problems.manufactured.exact import exact_model, manufacture, spectrum
from problems.manufactured.ladder import Ladder, Rung

from .degeneracy import crossed

DUPLICATED = 128
CONDITION = 1e4


def _make(n: int, tilt: float) -> ManufacturedProblem:
    d = spectrum(n, CONDITION)
    return manufacture(exact_model(d, d, A=crossed(contacts(n, DUPLICATED, tilt))), seed=3)


def _rung(n: int, bits: int) -> Rung:
    size, tilt = n // 2, 2.0**-bits
    problem = DeferredProblem((size, size), size + DUPLICATED, partial(_make, size, tilt))
    return Rung(f"Two parts, {DUPLICATED} contacts duplicated, {tilt:.0e} apart, n = {n}", made=problem)


RUNGS: Ladder = {
    f"{n}-{2.0**-bits:.0e}": partial(_rung, n, bits)
    for n, bits in ((6112, 4), (6112, 8), (6112, 10), (6112, 12), (11308, 12))
}
