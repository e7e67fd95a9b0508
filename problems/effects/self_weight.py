"""Self-weight of a part, in the junction and beyond it."""

from typing import Annotated

import numpy as np

from problems.forms.assembly import Vector
from problems.input.bounded_types import Finite, Positive
from problems.model.part import PartLoadEffect, PartModel

KG_PER_M3_TIMES_M_PER_S2 = 1e-9  # N/mm³


class SelfWeight(PartLoadEffect):
    """f += ρ g t ∫ φ over the part: density ρ in kg/m³, gravity g in m/s².

    A positive gravity pulls the part in the direction of positive displacements. The weight is that of
    the plate and its pads, not of stringers and ribs.
    """

    density: Annotated[Positive, "kg/m³"] = 2700.0
    gravity: Annotated[Finite, "m/s²"] = 9.80665

    def load(self, model: PartModel) -> Vector:
        weight = self.density * self.gravity * KG_PER_M3_TIMES_M_PER_S2
        f = np.zeros(model.plate.size)
        for sign, thickness, (x, _), (y, _) in model.areas():
            f += sign * weight * thickness * np.kron(y, x)
        return f
