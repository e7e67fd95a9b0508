"""How many digits a user's stiffness matrix seems to have, and the error if it was rounded to these."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from harness.verification.judge import LIMIT_MM
from problems.forms.assembly import Assembly, Vector
from problems.forms.prepared import Prepared
from problems.input.digits import DOUBLE, apparent_digits, expected_error


def digits_of(assembly: Assembly) -> int:
    """The fewest digits that the entries of a block of K seem to have, at most 16."""
    return min(apparent_digits(_entries(K)) for K in assembly.K.matrices)


def _entries(K: Any) -> Vector:
    return K.data if sp.issparse(K) else K[np.nonzero(K)]


def digits_sentence(data: Prepared, x: Vector, lam: Vector) -> tuple[str, bool]:
    """A sentence on the digits of K, and whether they are too few for 1e-7 mm at the answer x, λ."""
    digits = digits_of(data.assembly)
    if digits == DOUBLE:
        return "The entries of K have all digits of double precision", False
    error = expected_error(data, x, lam, digits)
    text = f"The entries of K seem to have {digits} digits: if they were rounded, displacements are off by"
    few = error > LIMIT_MM
    more = f", more than {LIMIT_MM:g} mm: export it with more digits" if few else ""
    return f"{text} about {error:.0e} mm{more}", few
