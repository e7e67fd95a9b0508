"""Uniform pressure on one part where it faces others."""

from typing import Annotated

import numpy as np

from problems.forms.assembly import Vector
from problems.input.bounded_types import Finite
from problems.model.effect import ForceEffect, PartEffect
from problems.model.interface import AnyJoint


class Pressure(PartEffect, ForceEffect):
    """f_i += value · a_i, with a_i the tributary area of node i; value in N/mm² (MPa).

    The load acts on the junction nodes only, and the areas sum to that of the junction. A positive pressure
    pushes the part in the direction of positive displacements.
    """

    value: Annotated[Finite, "N/mm²"]

    def force(self, joint: AnyJoint) -> Vector:
        f = np.zeros(joint.size[0])
        f[joint.unknowns(self.part)] = self.value * joint.areas(self.part)
        return f
