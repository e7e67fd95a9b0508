"""Shims: a sheet of given thickness fills the gap over a rectangle."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from problems.forms.assembly import Mask, Vector
from problems.input.bounded import Finite, Positive
from problems.model.effect import ContactEffect, Effect, GapEffect, at_contacts
from problems.model.joint import Faults, Joint


class Shims(ContactEffect, GapEffect):
    """g −= thickness at every contact with x and y in the ranges, borders included; mm.

    A shim is rigid. One thicker than the gap holds the parts apart; overlapping shims add up.
    """

    thickness: Annotated[Positive, "mm"]
    x: Annotated[tuple[Finite, Finite], "mm"]
    y: Annotated[tuple[Finite, Finite], "mm"]

    def faults(self, joint: Joint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        if not self._covered(joint).any():
            hx, hy = joint.x[1] - joint.x[0], joint.y[1] - joint.y[0]
            allowed = f"ranges that contain a node; nodes are spaced {hx:g} × {hy:g} mm from (0, 0)"
            yield "x, y", [list(self.x), list(self.y)], allowed

    def _covered(self, joint: Joint) -> Mask:
        at_x, at_y = joint.nodes.T
        return (self.x[0] <= at_x) & (at_x <= self.x[1]) & (self.y[0] <= at_y) & (at_y <= self.y[1])

    def gap(self, joint: Joint) -> Vector:
        return at_contacts(np.where(self._covered(joint), -self.thickness, 0.0), self.pairs(joint), joint)
