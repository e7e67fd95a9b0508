"""Holding clamps: each presses the parts together over a round pad."""

from typing import Annotated

import numpy as np

from problems.forms.assembly import Vector
from problems.input.bounded import Positive
from problems.model.effect import ContactEffect, pressing_forces
from problems.model.joint import Joint
from problems.model.positions import Positions


class Clamps(Positions, ContactEffect):
    """f += force on the first part of every contact, −= on the second, shared by the nodes under the pad.

    clamping_force in N per clamp, spread evenly over the junction nodes within `radius` mm of the clamp's
    node.
    """

    clamping_force: Annotated[Positive, "N"]
    radius: Annotated[Positive, "mm"] = 20.0

    def force(self, joint: Joint) -> Vector:
        nodal = np.zeros(joint.node_count)
        for centre in joint.nodes[self.nearest_nodes(joint)]:
            under = np.hypot(*(joint.nodes - centre).T) <= self.radius
            nodal[under] += self.clamping_force / under.sum()
        return pressing_forces(nodal, self.pairs(joint), joint)
