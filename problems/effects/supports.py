"""Point supports: springs between the part and the ground."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

import scipy.sparse as sp
from pydantic import Field

from problems.fem.plate import Plate
from problems.input.bounded import Finite, Positive
from problems.model.effect import StiffnessEffect
from problems.model.joint import Joint


class Supports(StiffnessEffect):
    """K += stiffness · Σ e eᵀ with e·(degrees of freedom) the deflection at a point.

    points in mm, on the part; stiffness in N/mm.
    """

    kind: Literal["supports"]
    points: Annotated[tuple[tuple[Finite, Finite], ...], Field(min_length=1)]
    stiffness_per_point: Positive = 1e6

    @property
    def held_points(self) -> tuple[tuple[float, float], ...]:
        return self.points

    def faults(self, joint: Joint) -> Iterator[tuple[str, object, str]]:
        yield from super().faults(joint)
        for part in joint.part:
            if part.name == self.part:
                y = joint.plate(part).y
                for k, (px, py) in enumerate(self.points):
                    if not (0 <= px <= joint.junction.length and y[0] <= py <= y[-1]):
                        allowed = f"on the part, 0 … {joint.junction.length:g} × {y[0]:g} … {y[-1]:g} mm"
                        yield f"points[{k}]", [px, py], allowed

    def stiffness(self, plate: Plate) -> sp.csr_array:
        e = sp.vstack([plate.evaluate(x, y) for x, y in self.points])
        return (self.stiffness_per_point * (e.T @ e)).tocsr()
