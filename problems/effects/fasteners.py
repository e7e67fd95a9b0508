"""Fasteners: each presses the two parts of a contact together at one junction node."""

from typing import Annotated

import numpy as np

from problems.forms.assembly import Vector
from problems.input.bounded import Positive
from problems.model.effect import ContactEffect, pressing_forces
from problems.model.joint import Joint
from problems.model.positions import Positions


class Fasteners(Positions, ContactEffect):
    """f += preload on the first part of every contact, f −= preload on the second, in N.

    A temporary fastener, or a rivet while it is being set: a force, no stiffness. It acts on the nearest
    junction node, at most half a node spacing away; two fasteners on one node add up.
    """

    preload: Annotated[Positive, "N"]

    def force(self, joint: Joint) -> Vector:
        nodal = np.zeros(joint.node_count)
        np.add.at(nodal, self.nearest_nodes(joint), self.preload)
        return pressing_forces(nodal, self.pairs(joint), joint)
