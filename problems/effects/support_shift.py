"""Support shift: supports displaced from their nominal position."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import Field

from problems.forms.assembly import Vector
from problems.input.bounded_types import Finite
from problems.model.effect import Effect
from problems.model.interface import AnyJoint
from problems.model.joint import Faults
from problems.model.part import PartLoadEffect, PartModel

from .supports import Supports


class SupportShift(PartLoadEffect):
    """f += k · shift · e at each of `points`, where the scene has a support of stiffness k.

    The spring of a support is then unloaded at w = shift (mm) instead of w = 0.
    """

    points: Annotated[tuple[tuple[Finite, Finite], ...], Field(min_length=1), "mm"]
    shift: Annotated[Finite, "mm"]

    def faults(self, joint: AnyJoint, others: Sequence[Effect] | None = None) -> Faults:
        """Yield the faults, those of missing supports only beside others: stages may set them."""
        yield from super().faults(joint, others or ())

        def points(kind: type[SupportShift | Supports]) -> list[tuple[float, float]]:
            mine = [other for other in others or () if isinstance(other, kind) and other.part == self.part]
            return [point for other in mine for point in other.points]

        shifted, supported = points(SupportShift), points(Supports)
        for k, point in enumerate(self.points):
            if others is not None and point not in supported:
                allowed = f"a point of a supports effect of part {self.part}, one of {supported}"
                yield f"points[{k}]", list(point), allowed
            if point in shifted:
                yield f"points[{k}]", list(point), "one support_shift per support: another shifts this one"

    def load(self, model: PartModel) -> Vector:
        f = np.zeros(model.plate.size)
        for effect in model.effects:
            if isinstance(effect, Supports):
                for point in (point for point in effect.points if point in self.points):
                    f += effect.stiffness_per_point * self.shift * model.plate.evaluate(*point).toarray()[0]
        return f
