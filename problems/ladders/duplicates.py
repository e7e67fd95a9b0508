"""Nearly dependent constraints: nearly equal columns of A, in the end exact copies.

Eight contacts are duplicated; a duplicate touches the second part slightly beside the node of the original.
"""

from __future__ import annotations

from functools import partial

import scipy.sparse as sp

from problems.manufactured.exact import exact_model, manufacture, spectrum
from problems.manufactured.ladder import Ladder, ManufacturedProblem, Rung

N = 64  # unknowns per part
DUPLICATED = 8
CONDITION = 1e4


def contacts(n: int, duplicated: int, tilt: float) -> sp.csc_array:
    """A of two parts of n unknowns, in contact at each; the first contacts twice, `tilt` apart."""
    one = sp.eye_array(n, format="csc")
    beside = one[:, :duplicated] + tilt * one[:, duplicated : 2 * duplicated]
    return sp.csc_array(sp.block_array([[one, one[:, :duplicated]], [-one, -beside]]))


def _problem(tilt: float) -> ManufacturedProblem:
    d = spectrum(N, CONDITION)
    return manufacture(exact_model(d, d, A=contacts(N, DUPLICATED, tilt)), seed=3)


def _nearly_equal(bits: int) -> Rung:
    tilt = 2.0**-bits
    return Rung(f"Two parts, {DUPLICATED} contacts duplicated, {tilt:.0e} apart", made=_problem(tilt))


def _copies() -> Rung:
    title = f"Two parts, {DUPLICATED} contacts duplicated exactly"
    return Rung(title, made=_problem(0.0), refused="must not depend on the columns before it")


RUNGS: Ladder = {
    **{f"{2.0**-bits:.0e}": partial(_nearly_equal, bits) for bits in (4, 8, 12, 16)},
    "copies": _copies,
}
