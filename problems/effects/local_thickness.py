"""Local thickness: a rectangle of a part that is thicker or thinner than the rest."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import scipy.sparse as sp

from problems.input.bounded_types import Positive, Range
from problems.model.effect import Effect, StiffnessEffect
from problems.model.interface import AnyJoint, on_part
from problems.model.joint import Faults
from problems.model.plate import Plate


class LocalThickness(StiffnessEffect):
    """K += (D(t') − D(t)) / D(t) times the plate's own stiffness integrated over the rectangle; mm.

    The mid-plane stays where it is. self_weight and thermal_bending take it into account.
    """

    thickness: Annotated[Positive, "mm"]
    x: Annotated[Range, "mm"]
    y: Annotated[Range, "mm"]

    @property
    def pad(self) -> tuple[float, Range, Range]:
        return self.thickness, self.x, self.y

    def misfits(self, plate: Plate) -> Faults:
        if not all(map(plate.covers, self.x, self.y)):
            yield "x, y", [list(self.x), list(self.y)], on_part(plate)

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        for other in others:
            if (
                isinstance(other, LocalThickness)
                and other.part == self.part
                and max(self.x[0], other.x[0]) < min(self.x[1], other.x[1])
                and max(self.y[0], other.y[0]) < min(self.y[1], other.y[1])
            ):
                allowed = f"no overlap with another local_thickness, here {list(other.x)} × {list(other.y)}"
                yield "x, y", [list(self.x), list(self.y)], allowed

    def stiffness(self, plate: Plate) -> sp.csr_array:
        share = replace(plate, thickness=self.thickness).rigidity / plate.rigidity - 1
        return share * plate.stiffness(self.x, self.y)
