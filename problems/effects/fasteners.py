"""Fasteners: each presses the two parts of a contact together at one junction node."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from ..assembly import Matrix, Vector
from ..effect import ForceEffect
from ..joint import TOOL, Finite, Joint, Positive, Table


class Pattern(Table):
    """columns × rows fasteners, evenly spread over the junction up to `edge` mm from its border."""

    columns: Annotated[int, Field(ge=1)]
    rows: Annotated[int, Field(ge=1)]
    edge: Annotated[float, Field(ge=0)] = 0.0


class Fasteners(ForceEffect):
    """f += preload on the first part of every contact, f −= preload on the second, in N.

    A fastener acts on the junction node nearest to it, at most half a node spacing away; two
    fasteners on one node add up. Give either `points`, a list of (x, y) in mm, or a `pattern`.
    """

    kind: Literal["fasteners"]
    preload: Positive
    points: tuple[tuple[Finite, Finite], ...] = ()
    pattern: Pattern | None = None

    @model_validator(mode="after")
    def _one_of_both(self) -> Fasteners:
        if bool(self.points) == bool(self.pattern):
            raise ValueError("give either points or a pattern")
        return self

    def marks(self, joint: Joint) -> Matrix:
        """(k, 2) coordinates in mm."""
        if self.pattern is None:
            return np.array(self.points)
        x = _spread(joint.junction.length, self.pattern.edge, self.pattern.columns)
        y = _spread(joint.junction.width, self.pattern.edge, self.pattern.rows)
        X, Y = np.meshgrid(x, y)
        return np.column_stack([X.ravel(), Y.ravel()])

    def faults(self, joint: Joint) -> Iterator[tuple[str, object, str]]:
        length, width = joint.junction.length, joint.junction.width
        if self.pattern and 2 * self.pattern.edge > min(length, width):
            allowed = f"at most half the junction, {min(length, width) / 2:g} mm"
            yield "pattern.edge", self.pattern.edge, allowed
            return
        allowed = f"on the junction, 0 … {length:g} × 0 … {width:g} mm"
        for k, (x, y) in enumerate(self.marks(joint)):
            if not (0 <= x <= length and 0 <= y <= width):
                yield f"points[{k}]", [float(x), float(y)], allowed

    def force(self, joint: Joint) -> Vector:
        nx, _ = joint.junction.nodes
        positions = self.marks(joint)
        ix, iy = (
            np.abs(positions[:, [axis]] - grid).argmin(axis=1) for axis, grid in enumerate((joint.x, joint.y))
        )
        nodal = np.zeros(joint.node_count)
        np.add.at(nodal, iy * nx + ix, self.preload)
        f = np.zeros(joint.size[0])
        for first, second in joint.pairs:
            f[joint.unknowns(first)] += nodal
            if second != TOOL:
                f[joint.unknowns(second)] -= nodal
        return f


def _spread(size: float, edge: float, count: int) -> Vector:
    """count points between edge and size − edge; a single one in the middle."""
    return np.linspace(edge, size - edge, count) if count > 1 else np.array([size / 2])
