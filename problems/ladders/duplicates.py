"""Nearly dependent constraints: nearly equal columns of A, in the end exact copies.

Some contacts are duplicated; a duplicate touches the second part slightly beside the node of the original. At
2⁻¹⁶ a pivot of Q would be within the rounding of the 3184 contacts of n = 6112.
"""

from __future__ import annotations

from functools import partial

from problems.manufactured.exact import contacts, deferred
from problems.manufactured.ladder import Ladder, Scene, matrices


def _rung(n: int, duplicated: int, tilt: float) -> Scene:
    problem = deferred(n, 1e4, seed=3, A=contacts(n // 2, duplicated, tilt))
    if tilt:
        return matrices(f"Two parts, {duplicated} contacts duplicated, {tilt:.0e} apart", problem)
    refused = "must not depend on the columns before it"
    return matrices(f"Two parts, {duplicated} contacts duplicated exactly", problem, refused=refused)


RUNGS: Ladder = {
    **{f"{2.0**-bits:.0e}": partial(_rung, 128, 8, 2.0**-bits) for bits in (4, 8, 12, 16)},
    "copies": partial(_rung, 128, 8, 0.0),
}
FULL_SIZE: Ladder = {
    f"{n}-{2.0**-bits:.0e}": partial(_rung, n, 128, 2.0**-bits)
    for n, bits in ((6112, 4), (6112, 8), (6112, 10), (6112, 12), (11308, 12))
}
