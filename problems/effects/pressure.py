"""Uniform pressure on one part's junction strip."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from problems.forms.assembly import Vector
from problems.model.effect import ForceEffect, unknown_part
from problems.model.joint import Finite, Joint


class Pressure(ForceEffect):
    """f_i += value · a_i, with a_i the area that belongs to node i; value in N/mm² (MPa).

    The load stands on the junction nodes alone, as all loads of the model do, and the areas add up
    to the junction's. A positive pressure pushes the part in the direction of positive x.
    """

    kind: Literal["pressure"]
    part: str
    value: Finite

    def faults(self, joint: Joint) -> Iterator[tuple[str, object, str]]:
        yield from unknown_part(self.part, joint)

    def force(self, joint: Joint) -> Vector:
        f = np.zeros(joint.size[0])
        f[joint.unknowns(self.part)] = self.value * np.outer(_widths(joint.y), _widths(joint.x)).ravel()
        return f


def _widths(grid: Vector) -> Vector:
    """The length of line that belongs to each grid point (trapezoidal rule)."""
    h = np.diff(grid)
    return 0.5 * (np.append(h, 0.0) + np.insert(h, 0, 0.0))
