"""Point supports: springs between the part and the ground."""

from typing import Annotated

import scipy.sparse as sp
from pydantic import Field

from problems.input.bounded_types import Finite, Positive
from problems.model.effect import StiffnessEffect
from problems.model.joint import Faults
from problems.model.plate import Plate


class Supports(StiffnessEffect):
    """K += stiffness · Σ e eᵀ with e·(degrees of freedom) the deflection at a point.

    points in mm, on the part; stiffness in N/mm.
    """

    points: Annotated[tuple[tuple[Finite, Finite], ...], Field(min_length=1), "mm"]
    stiffness_per_point: Annotated[Positive, "N/mm"] = 1e6

    @property
    def held_points(self) -> tuple[tuple[float, float], ...]:
        return self.points

    def misfits(self, plate: Plate) -> Faults:
        length, (south, north) = plate.x[-1], plate.y[[0, -1]]
        for k, (x, y) in enumerate(self.points):
            if not (0 <= x <= length and south <= y <= north):
                yield f"points[{k}]", [x, y], f"on the part, 0 … {length:g} × {south:g} … {north:g} mm"

    def stiffness(self, plate: Plate) -> sp.csr_array:
        e = sp.vstack([plate.evaluate(x, y) for x, y in self.points])
        return (self.stiffness_per_point * (e.T @ e)).tocsr()
