"""Thermal bending: one face of a part is warmer than the other."""

from dataclasses import replace
from typing import Annotated

import numpy as np

from problems.forms.assembly import Vector
from problems.input.bounded_types import Finite, Positive
from problems.model.part import PartLoadEffect, PartModel


class ThermalBending(PartLoadEffect):
    """f −= D (1 + ν) κ ∫ (φ_xx + φ_yy) over the part, κ = α ΔT / t.

    difference ΔT in K: the temperature of the face in the direction of positive displacements minus that
    of the other, linear through the thickness; expansion α in 1/K. The free part would bend to
    w_xx = w_yy = −κ, without stress. Stringers and ribs stay at the mean temperature.
    """

    difference: Annotated[Finite, "K"]
    expansion: Annotated[Positive, "1/K"] = 23e-6

    def free_curvature(self, thickness: Vector) -> Vector:
        return self.expansion * self.difference / thickness

    def load(self, model: PartModel) -> Vector:
        plate = model.plate
        f = np.zeros(plate.size)
        for sign, thickness, (x, x_bend), (y, y_bend) in model.areas():
            (kappa,) = self.free_curvature(np.array([thickness]))
            moment = replace(plate, thickness=thickness).rigidity * (1 + plate.poisson) * kappa
            f -= sign * moment * (np.kron(y, x_bend) + np.kron(y_bend, x))
        return f
