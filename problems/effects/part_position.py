"""Part position: a part lies off its place, shifted and tilted as a rigid body, before it is fastened."""

from typing import Annotated

import numpy as np

from problems.forms.assembly import Vector
from problems.input.bounded_types import Finite
from problems.model.effect import GapEffect, PartEffect
from problems.model.interface import AnyJoint
from problems.model.joint import Pair
from problems.model.junction_terms import at_contacts, sides


class PartPosition(PartEffect, GapEffect):
    """g −= r where the part is the first of a contact, g += r where it is the second, with

        r = shift + slope_x (x − x_0) + slope_y (y − y_0), mm,

    how far it lies towards positive displacements, with its supports and free of stress; (x_0, y_0) is the
    centre of the junction.
    """

    shift: Annotated[Finite, "mm"] = 0.0
    slope_x: Annotated[Finite, "1"] = 0.0
    slope_y: Annotated[Finite, "1"] = 0.0

    def gap(self, joint: AnyJoint) -> Vector:
        def opened(pair: Pair) -> Vector:
            from_centre = joint.places(pair) - joint.bounds.mean(axis=0)
            r = self.shift + from_centre @ np.array([self.slope_x, self.slope_y])
            return -dict(sides(pair))[self.part] * r

        return at_contacts(opened, [pair for pair in joint.pairs if self.part in pair], joint)
