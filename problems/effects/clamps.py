"""Holding clamps: each presses the parts together over a round pad."""

from typing import Annotated

import numpy as np

from problems.forms.assembly import Vector
from problems.input.bounded import Positive
from problems.model.effect import ContactEffect, pressing_forces
from problems.model.joint import Joint
from problems.model.positions import Positions

_AXIS = (np.arange(16) - 7.5) / 8
_INSIDE = np.array([(x, y) for x in _AXIS for y in _AXIS if np.hypot(x, y) <= 1])
#: (k, 2) points that share the unit disc evenly, with its second moments, ¼.
DISC = _INSIDE / (2 * _INSIDE.std())


class Clamps(Positions, ContactEffect):
    """f += force on the first part of every contact, −= on the second, spread evenly under the pad.

    clamping_force in N per clamp, on what lies on the junction of a disc of `radius` mm around its place: on
    points that share it evenly, each by bilinear weights on the nodes around it.
    """

    clamping_force: Annotated[Positive, "N"]
    radius: Annotated[Positive, "mm"] = 20.0

    def force(self, joint: Joint) -> Vector:
        nodal, size = np.zeros(joint.node_count), (joint.junction.length, joint.junction.width)
        for centre in self.marks(joint):
            points = centre + self.radius * DISC
            under = points[((points >= 0) & (points <= size)).all(axis=1)]
            nodal += self.clamping_force / len(under) * joint.weights(under).sum(axis=0)
        return pressing_forces(nodal, self.pairs(joint), joint)
