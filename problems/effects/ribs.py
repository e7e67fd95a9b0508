"""Ribs: beams along x over the full length of the part, bonded to the skin."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

import scipy.sparse as sp
from pydantic import Field

from problems.fem.plate import Plate
from problems.input.bounded import Finite, NotNegative, Positive
from problems.model.effect import StiffnessEffect
from problems.model.joint import Joint


class Ribs(StiffnessEffect):
    """K += Σ EI ∫ w_xx² dx + GJ ∫ w_xy² dx at each y of `lines`; mm and mm⁴."""

    kind: Literal["ribs"]
    lines: Annotated[tuple[Finite, ...], Field(min_length=1)]
    I: Positive  # noqa: E741
    J: NotNegative = 0.0

    def faults(self, joint: Joint) -> Iterator[tuple[str, object, str]]:
        yield from super().faults(joint)
        for part in joint.part:
            if part.name == self.part:
                y = joint.plate(part).y
                for k, line in enumerate(self.lines):
                    if not y[0] <= line <= y[-1]:
                        yield f"lines[{k}]", line, f"on the part, {y[0]:g} … {y[-1]:g} mm"

    def stiffness(self, plate: Plate) -> sp.csr_array:
        EI, GJ = plate.young * self.I, plate.shear_modulus * self.J
        beams = (plate.beam_along_x(y, EI, GJ) for y in self.lines)
        return sum(beams, start=sp.csr_array((plate.size, plate.size)))
