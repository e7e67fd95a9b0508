"""Two parts with ever more weakly active contacts at full size, made from their answer without rounding."""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy.sparse as sp

from problems.forms.manufactured_problem import DeferredProblem, ManufacturedProblem
from problems.manufactured.exact import Shares, exact_model, manufacture, spectrum
from problems.manufactured.ladder import Ladder, Rung

CONDITION = 1e6


def crossed(A: sp.csc_array) -> sp.csc_array:
    """A with the unknowns of the second of two equal parts in reverse order.

    K of a part is block diagonal, with a Hadamard matrix in each block: so its blocks overlap the other's.
    """
    n = A.shape[0] // 2
    return sp.csc_array(A[np.r_[:n, 2 * n - 1 : n - 1 : -1]])


def touching(n: int, condition: float, shares: Shares) -> ManufacturedProblem:
    """Two parts of n unknowns in contact at each."""
    one, d = sp.eye_array(n), spectrum(n, condition)
    A = crossed(sp.csc_array(sp.vstack([one, -one])))
    return manufacture(exact_model(d, d, A=A), seed=2, shares=shares)


def _rung(n: int, percent: int) -> Rung:
    size, weak = n // 2, percent / 100
    shares = Shares(min(0.4, 1 - weak), weak)
    problem = DeferredProblem((size, size), size, partial(touching, size, CONDITION, shares))
    return Rung(f"Two parts, {percent} % of the contacts touch without a force, n = {n}", made=problem)


RUNGS: Ladder = {
    f"{n}-{percent:03d}": partial(_rung, n, percent)
    for n, percent in ((4386, 25), (4386, 50), (4386, 75), (4386, 100), (11308, 50))
}
