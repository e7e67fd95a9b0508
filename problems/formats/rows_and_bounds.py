"""A convex quadratic program as others state it, as a contact problem.

    min ½xᵀPx + qᵀx,   l ≤ Cx ≤ u,   lower ≤ x ≤ upper      →      K = P, f = −q, Aᵀx ≤ g

Each finite bound of a row of C or of an unknown is a contact. Bounds of 1e20 and more are infinite, as in the
Maros and Mészáros test set.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.errors import Fault, InputError
from problems.formats import Data, vector

INFINITE = 1e20
NAMED = 5  # faults of a kind


def contact_problem(path: Path, P: Any, q: Any, C: Any, lower: Any, upper: Any) -> Data:
    """C (k, n) with the bounds of each row; those of the unknowns as rows of an identity.

    Raises InputError for equations, two finite bounds on a row, and bounds that exclude each other.
    """
    C, lower, upper = sp.csr_array(C), vector(lower), vector(upper)
    if not C.shape[0] == len(lower) == len(upper):
        found = f"{C.shape[0]} rows, {len(lower)} lower and {len(upper)} upper bounds"
        raise InputError.one(path, "constraints", found, "a lower and an upper bound for each row")
    below, above = upper < INFINITE, lower > -INFINITE
    wrong = {
        "the lower bound is above the upper one: nothing satisfies both": lower > upper,
        "an equation; contact problems have inequalities only": below & above & (lower == upper),
        "two finite bounds; the contacts must be independent, so a row may have one": (
            below & above & (lower < upper)
        ),
        "not a number": np.isnan(lower) | np.isnan(upper),
    }
    faults = [
        Fault(str(path), f"row {row + 1}", f"[{lower[row]:g}, {upper[row]:g}]", f"{why} ({rows.sum()} such)")
        for why, rows in wrong.items()
        for row in np.flatnonzero(rows)[:NAMED]
    ]
    if faults:
        raise InputError(faults)
    A = sp.vstack([C[below], -C[above]]).T
    g = np.concatenate([upper[below], -lower[above]])
    return {"K": sp.csr_array(P), "A": sp.csc_array(A), "f": -vector(q), "g": g}
