"""Ribs: beams along x over the full length of the part, bonded to the skin."""

from typing import Annotated

import scipy.sparse as sp
from pydantic import Field

from problems.input.bounded_types import Finite, NotNegative, Positive
from problems.model.effect import StiffnessEffect
from problems.model.joint import Faults
from problems.model.plate import Plate


class Ribs(StiffnessEffect):
    """K += Σ EI ∫ w_xx² dx + GJ ∫ w_xy² dx at each y of `lines`; mm and mm⁴."""

    lines: Annotated[tuple[Finite, ...], Field(min_length=1), "mm"]
    I: Annotated[Positive, "mm⁴"]  # noqa: E741
    J: Annotated[NotNegative, "mm⁴"] = 0.0

    def misfits(self, plate: Plate) -> Faults:
        south, north = plate.y[[0, -1]]
        for k, line in enumerate(self.lines):
            if not south <= line <= north:
                yield f"lines[{k}]", line, f"on the part, {south:g} … {north:g} mm"

    def stiffness(self, plate: Plate) -> sp.csr_array:
        EI, GJ = plate.young * self.I, plate.shear_modulus * self.J
        return plate.beams(self.lines, EI, GJ, along_x=True)
