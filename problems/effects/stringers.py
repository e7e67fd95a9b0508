"""Stringers: equally spaced beams along y, bonded to the skin."""

from typing import Annotated

import numpy as np
import scipy.sparse as sp

from problems.input.bounded_types import Finite, NotNegative, Positive
from problems.model.effect import StiffnessEffect
from problems.model.interface import on_part
from problems.model.joint import Faults
from problems.model.plate import Plate

MOST = 10_000


class Stringers(StiffnessEffect):
    """K += Σ EI ∫ w_yy² dy + GJ ∫ w_xy² dy over start ≤ y ≤ stop, at x = 0, pitch, 2·pitch, …

    pitch, start, stop in mm; I and J in mm⁴. E and G = E / 2(1 + ν) are the part's.
    """

    pitch: Annotated[Positive, "mm"]
    start: Annotated[Finite, "mm"]
    stop: Annotated[Finite, "mm"]
    I: Annotated[Positive, "mm⁴"]  # noqa: E741
    J: Annotated[NotNegative, "mm⁴"] = 0.0

    def misfits(self, plate: Plate) -> Faults:
        south, north = plate.y[[0, -1]]
        if max(self.start, south) >= min(self.stop, north):
            yield "start, stop", [self.start, self.stop], f"a length {on_part(plate)}"
        if plate.x[-1] > MOST * self.pitch:
            yield "pitch", self.pitch, f"at least {plate.x[-1] / MOST:g} mm: {MOST} stringers"

    def stiffness(self, plate: Plate) -> sp.csr_array:
        positions = np.arange(0.0, plate.x[-1] + 1e-9 * self.pitch, self.pitch)
        lines = np.minimum(positions, plate.x[-1]).tolist()
        return plate.beams(lines, self.I, self.J, along_x=False, ends=(self.start, self.stop))
