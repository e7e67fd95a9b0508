"""Ribs: beams along x over the full length of the part, bonded to the skin."""

from collections.abc import Sequence
from typing import Annotated

import scipy.sparse as sp
from pydantic import Field

from problems.input.bounded_types import Finite, NotNegative, Positive
from problems.input.scan_points import CLOSE
from problems.model.effect import Effect, StiffnessEffect
from problems.model.interface import AnyJoint, on_part
from problems.model.joint import Faults
from problems.model.plate import Plate


class Ribs(StiffnessEffect):
    """K += Σ EI ∫ w_xx² dx + GJ ∫ w_xy² dx at each y of `lines`; mm and mm⁴."""

    lines: Annotated[tuple[Finite, ...], Field(min_length=1), "mm"]
    I: Annotated[Positive, "mm⁴"]  # noqa: E741
    J: Annotated[NotNegative, "mm⁴"] = 0.0

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        ribs = [other for other in others if isinstance(other, Ribs) and other.part == self.part]
        for k, y in enumerate(self.lines):
            if any(abs(line - y) <= CLOSE for other in ribs for line in other.lines):
                yield f"lines[{k}]", y, "a line of its own: other ribs are there, too"

    def misfits(self, plate: Plate) -> Faults:
        for k, y in enumerate(self.lines):
            if not plate.covers(0.0, y):
                yield f"lines[{k}]", y, on_part(plate)
            for first in [i for i in range(k) if abs(self.lines[i] - y) <= CLOSE][:1]:
                yield f"lines[{k}]", y, f"a line of its own: lines[{first}] is there, too"

    def stiffness(self, plate: Plate) -> sp.csr_array:
        return plate.beams(self.lines, self.I, self.J, along_x=True)
