"""Ribs: beams along x over the full length of the part, bonded to the skin."""

from typing import Annotated

import scipy.sparse as sp
from pydantic import Field

from problems.input.bounded_types import Finite, NotNegative, Positive
from problems.input.scan_points import CLOSE
from problems.model.effect import StiffnessEffect
from problems.model.interface import on_part
from problems.model.joint import Faults
from problems.model.plate import Plate


class Ribs(StiffnessEffect):
    """K += Σ EI ∫ w_xx² dx + GJ ∫ w_xy² dx at each y of `lines`; mm and mm⁴."""

    lines: Annotated[tuple[Finite, ...], Field(min_length=1), "mm"]
    I: Annotated[Positive, "mm⁴"]  # noqa: E741
    J: Annotated[NotNegative, "mm⁴"] = 0.0

    def misfits(self, plate: Plate) -> Faults:
        for k, y in enumerate(self.lines):
            if not plate.covers(0.0, y):
                yield f"lines[{k}]", y, on_part(plate)
            for first in [i for i in range(k) if abs(self.lines[i] - y) <= CLOSE][:1]:
                yield f"lines[{k}]", y, f"a line of its own: lines[{first}] is there, too"

    def stiffness(self, plate: Plate) -> sp.csr_array:
        return plate.beams(self.lines, self.I, self.J, along_x=True)
