"""A rigid tool: a surface that one part may touch but not penetrate."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from problems.forms.assembly import Vector
from problems.input.bounded_types import Finite
from problems.model.effect import Effect, GapEffect, PartEffect
from problems.model.interface import AnyJoint
from problems.model.joint import TOOL, Faults, Pair
from problems.model.junction_terms import at_contacts


class RigidTool(PartEffect, GapEffect):
    """A contact x ≤ g of `part` and the tool at every junction node, with

        g += distance + ½ κ_x (x − x_0)² + ½ κ_y (y − y_0)².

    distance in mm; curvature = (κ_x, κ_y) in 1/mm, positive if the tool curves away from the part;
    crest = (x_0, y_0) in mm, by default the centre of the junction.
    """

    distance: Annotated[Finite, "mm"] = 0.0
    curvature: Annotated[tuple[Finite, Finite], "1/mm"] = (0.0, 0.0)
    crest: Annotated[tuple[Finite, Finite] | None, "mm"] = None

    @property
    def contacts(self) -> tuple[Pair, ...]:
        return ((self.part, TOOL),)

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        if any(isinstance(other, RigidTool) and other.part == self.part for other in others):
            yield "part", self.part, "one rigid_tool per part: another one faces this part"

    def gap(self, joint: AnyJoint) -> Vector:
        crest = self.crest or tuple(joint.bounds.mean(axis=0))

        def away(pair: Pair) -> Vector:
            return np.asarray(self.distance + 0.5 * (joint.places(pair) - crest) ** 2 @ self.curvature)

        return at_contacts(away, self.contacts, joint)
