"""Contacts that say nearly the same: columns of A that are nearly dependent, in the end exact copies.

Eight contacts stand twice; the second ones touch the second part a little beside the node of the first.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy.sparse as sp

from problems.manufactured.exact import frame, solved, spectrum
from problems.manufactured.ladder import Ladder, Made, Rung

N = 64  # unknowns a part
TWICE = 8
CONDITION = 1e4


def _problem(tilt: float) -> Made:
    one = np.eye(N)
    beside = one[:, :TWICE] + tilt * one[:, TWICE : 2 * TWICE]
    A = sp.csc_array(np.block([[one, one[:, :TWICE]], [-one, -beside]]))
    d = spectrum(N, CONDITION)
    return solved(frame(d, d, A=A), seed=3)


def _near(bits: int) -> Rung:
    tilt = 2.0**-bits
    return Rung(f"Two parts, {TWICE} contacts twice, {tilt:.0e} apart", made=_problem(tilt))


def _copies() -> Rung:
    title = f"Two parts, {TWICE} contacts exactly twice"
    return Rung(title, made=_problem(0.0), refused="must not depend on the columns before it")


RUNGS: Ladder = {
    **{f"{2.0**-bits:.0e}": partial(_near, bits) for bits in (4, 8, 12, 16)},
    "copies": _copies,
}
