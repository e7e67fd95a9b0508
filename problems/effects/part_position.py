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
    """g −= n·r where the part is the first of a contact, g += n·r where it is the second; n is its normal,

        r = (−slope_x z, −slope_y z, shift + slope_x x + slope_y y), mm,

    how far the part lies towards positive displacements, with its supports and free of stress. x, y and the
    height z above the plane of the junction are from its centre. Plates have n = (0, 0, 1).
    """

    shift: Annotated[Finite, "mm"] = 0.0
    slope_x: Annotated[Finite, "1"] = 0.0
    slope_y: Annotated[Finite, "1"] = 0.0

    def gap(self, joint: AnyJoint) -> Vector:
        slopes = np.array([self.slope_x, self.slope_y])

        def opened(pair: Pair) -> Vector:
            return -dict(sides(pair))[self.part] * joint.rigid_motion(self.part, pair, self.shift, slopes)

        return at_contacts(opened, [pair for pair in joint.pairs if self.part in pair], joint)
