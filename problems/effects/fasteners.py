"""Fasteners: each presses the two parts of a contact together at a point."""

from typing import Annotated, ClassVar

import numpy as np

from problems.forms.assembly import Vector
from problems.input.bounded_types import Positive
from problems.model.effect import OneOr
from problems.model.interface import AnyJoint
from problems.model.junction_terms import pressing_forces
from problems.model.positions import Positions


class Fasteners(Positions):
    """f += preload on the first part of every contact, f −= preload on the second, in N, of all or of each.

    A temporary fastener, or a rivet while it is being set: a force, no stiffness. It acts where it is: on the
    nodes around it, by the weights of its place.
    """

    more_columns: ClassVar[tuple[str, ...]] = ("preload",)
    preload: Annotated[OneOr[Positive, tuple[Positive, ...]], "N"]

    def force(self, joint: AnyJoint) -> Vector:
        presses = [(self.marks(joint), np.asarray(self.preload))]
        return pressing_forces(lambda pair: presses, self.pairs(joint), joint)
