"""Uniform pressure on one part's junction strip."""

from typing import Annotated

import numpy as np

from problems.forms.assembly import Vector
from problems.input.bounded import Finite
from problems.model.effect import ForceEffect, PartEffect
from problems.model.joint import Joint


class Pressure(PartEffect, ForceEffect):
    """f_i += value · a_i, with a_i the tributary area of node i; value in N/mm² (MPa).

    The load acts on the junction nodes only, and the areas sum to that of the junction. A positive pressure
    pushes the part in the direction of positive displacements.
    """

    value: Annotated[Finite, "N/mm²"]

    def force(self, joint: Joint) -> Vector:
        f = np.zeros(joint.size[0])
        f[joint.unknowns(self.part)] = (
            self.value * np.outer(_tributary_lengths(joint.y), _tributary_lengths(joint.x)).ravel()
        )
        return f


def _tributary_lengths(grid: Vector) -> Vector:
    """The tributary length of each grid point (trapezoidal rule)."""
    h = np.diff(grid)
    return 0.5 * (np.append(h, 0.0) + np.insert(h, 0, 0.0))
