"""Fasteners: each presses the two parts of a contact together at a point."""

from typing import Annotated

from problems.forms.assembly import Vector
from problems.input.bounded_types import Positive
from problems.model.interface import AnyJoint
from problems.model.junction_terms import pressing_forces
from problems.model.positions import Positions


class Fasteners(Positions):
    """f += preload on the first part of every contact, f −= preload on the second, in N.

    A temporary fastener, or a rivet while it is being set: a force, no stiffness. It acts where it is: on the
    nodes around it, by the weights of its place.
    """

    preload: Annotated[Positive, "N"]

    def force(self, joint: AnyJoint) -> Vector:
        places = [(self.marks(joint), self.preload)]
        return pressing_forces(lambda pair: places, self.pairs(joint), joint)
