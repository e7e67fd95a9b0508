"""Point supports: springs between the part and the ground."""

from collections.abc import Sequence
from typing import Annotated, Self

import scipy.sparse as sp
from pydantic import Field

from problems.input.bounded_types import Finite, Positive
from problems.model.effect import StiffnessEffect
from problems.model.interface import AnyJoint, on_part
from problems.model.joint import Faults
from problems.model.plate import Plate


class Supports(StiffnessEffect):
    """K += stiffness_per_point · Σ e eᵀ, e·(degrees of freedom) the deflection at a point.

    points in mm, on the part; stiffness_per_point in N/mm.
    """

    points: Annotated[tuple[tuple[Finite, Finite], ...], Field(min_length=1), "mm"]
    stiffness_per_point: Annotated[Positive, "N/mm"] = 1e6

    @property
    def held_points(self) -> tuple[tuple[float, float], ...]:
        return self.points

    def element_count(self, joint: AnyJoint) -> int:
        return len(self.points)

    def only(self, elements: Sequence[int], joint: AnyJoint) -> Self:
        return self.model_copy(update={"points": tuple(self.points[k] for k in elements)})

    def misfits(self, plate: Plate) -> Faults:
        for k, point in enumerate(self.points):
            if not plate.covers(*point):
                yield f"points[{k}]", list(point), on_part(plate)

    def stiffness(self, plate: Plate) -> sp.csr_array:
        e = sp.vstack([plate.evaluate(x, y) for x, y in self.points])
        return (self.stiffness_per_point * (e.T @ e)).tocsr()
