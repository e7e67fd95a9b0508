"""Holding clamps: each presses the parts together over a round pad."""

from collections.abc import Iterator
from typing import Annotated, ClassVar

import numpy as np

from problems.forms.assembly import Matrix, Vector
from problems.input.bounded_types import Positive
from problems.model.interface import AnyJoint
from problems.model.joint import Faults, Pair
from problems.model.junction_terms import pressing_forces, sides
from problems.model.positions import Positions

_AXIS = (np.arange(16) - 7.5) / 8
_INSIDE = np.array([(x, y) for x in _AXIS for y in _AXIS if np.hypot(x, y) <= 1])
#: (k, 2) points that share the unit disc evenly, with its second moments, ¼.
DISC = _INSIDE / (2 * _INSIDE.std())


class Clamps(Positions):
    """f += force on the first part of every contact, −= on the second, spread evenly under the pad.

    clamping_force in N per clamp, on the part of a disc of `radius` mm that both parts cover. Points of that
    disc share the force evenly, and each acts on the nodes around it by the weights of its place.
    """

    in_holes: ClassVar[bool] = False
    clamping_force: Annotated[Positive, "N"]
    radius: Annotated[Positive, "mm"] = 20.0

    def unusual(self, joint: AnyJoint) -> Faults:
        yield from super().unusual(joint)
        if self.radius > (longest := float(np.ptp(joint.bounds, axis=0).max())):
            yield "radius", self.radius, f"at most {longest:g} mm, the longer side of the junction"

    def force(self, joint: AnyJoint) -> Vector:
        centres = self.marks(joint)

        def under(pair: Pair) -> Iterator[tuple[Matrix, float]]:
            parts = tuple(part for part, _ in sides(pair))
            for centre in centres:
                points = centre + self.radius * DISC
                points = points[joint.covers(parts, points)]
                points = points if len(points) else centre[None]
                yield points, self.clamping_force / len(points)

        return pressing_forces(under, self.pairs(joint), joint)
