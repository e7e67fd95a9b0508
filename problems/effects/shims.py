"""Shims: a sheet of given thickness fills the gap over a rectangle."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from problems.forms.assembly import Mask, Matrix, Vector
from problems.input.bounded_types import Positive, Range
from problems.model.effect import ContactEffect, Effect, GapEffect
from problems.model.interface import AnyJoint
from problems.model.joint import Faults, Pair
from problems.model.junction_terms import at_contacts


class Shims(ContactEffect, GapEffect):
    """g −= thickness at every contact with x and y in the ranges, borders included; mm.

    A shim is rigid. One thicker than the gap holds the parts apart; overlapping shims add up.
    """

    thickness: Annotated[Positive, "mm"]
    x: Annotated[Range, "mm"]
    y: Annotated[Range, "mm"]

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        pairs = [pair for pair in self.pairs(joint) if pair in joint.pairs]
        places = np.concatenate([np.zeros((0, 2)), *map(joint.places, pairs)])
        if len(places) and not self._covered(places).any():
            x, y = places[((places - np.mean([self.x, self.y], axis=1)) ** 2).sum(axis=1).argmin()]
            yield "x, y", [list(self.x), list(self.y)], f"ranges with a node; the nearest: at {x:g}, {y:g} mm"

    def _covered(self, nodes: Matrix) -> Mask:
        at_x, at_y = nodes.T
        return (self.x[0] <= at_x) & (at_x <= self.x[1]) & (self.y[0] <= at_y) & (at_y <= self.y[1])

    def gap(self, joint: AnyJoint) -> Vector:
        def filled(pair: Pair) -> Vector:
            return np.where(self._covered(joint.places(pair)), -self.thickness, 0.0)

        return at_contacts(filled, self.pairs(joint), joint)
