"""Fasteners: each presses the two parts of a contact together at a point."""

from typing import Annotated

from problems.forms.assembly import Vector
from problems.input.bounded import Positive
from problems.model.effect import ContactEffect, pressing_forces
from problems.model.joint import Joint
from problems.model.positions import Positions


class Fasteners(Positions, ContactEffect):
    """f += preload on the first part of every contact, f −= preload on the second, in N.

    A temporary fastener, or a rivet while it is being set: a force, no stiffness. It acts where it is: on the
    nodes of the element around it, by bilinear weights. Two fasteners at one place add up.
    """

    preload: Annotated[Positive, "N"]

    def force(self, joint: Joint) -> Vector:
        nodal = self.preload * joint.weights(self.marks(joint)).sum(axis=0)
        return pressing_forces(nodal, self.pairs(joint), joint)
