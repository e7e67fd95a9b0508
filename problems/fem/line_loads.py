"""Loads on cubic Hermite functions: their integrals, and those of their second derivatives."""

from __future__ import annotations

import numpy as np

from problems.forms.assembly import Vector

from .hermite import line_matrices


def line_loads(grid: Vector, start: float, stop: float) -> tuple[Vector, Vector]:
    """∫φ and ∫φ'' over [start, stop], each (2N,): M and B applied to the function 1."""
    line = line_matrices(grid, start, stop)
    one = np.tile([1.0, 0.0], len(grid))
    return line.M @ one, line.B @ one
