"""Euclidean norms from above, whatever the size of the entries."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.forms.assembly import Matrix

from .exact_residual import ETA, exponent


def length(v: Matrix) -> Any:
    """‖v‖₂ of a vector, or of each column, but for a relative rounding of nu; not finite if v is not.

    Squares of entries below 1e-162 would underflow: v is scaled by a power of two first.
    """
    scale = np.exp2(exponent(abs(v).max(axis=0, initial=0.0)))
    norm = np.linalg.norm(v / scale, axis=0)
    return scale * norm + ETA * (norm > 0)  # the product may be rounded to a multiple of η
