"""Effects at positions: points on the junction, each moved to its nearest node."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from problems.forms.assembly import Indices, Matrix, Vector
from problems.input.bounded import Finite, NotNegative

from .effect import Effect, ForceEffect
from .joint import Faults, Joint, Table


class Pattern(Table):
    """columns × rows points, evenly spaced over the junction up to `edge` mm from its border."""

    columns: Annotated[int, Field(ge=1, le=10_000)]
    rows: Annotated[int, Field(ge=1, le=10_000)]
    edge: Annotated[NotNegative, "mm"] = 0.0


class Positions(ForceEffect):
    """Forces at `points`, a list of (x, y) in mm; or `file`, a CSV with columns x and y; or a `pattern`."""

    columns: ClassVar[tuple[str, ...]] = ("x", "y")
    points: Annotated[tuple[tuple[Finite, Finite], ...], "mm"] = ()
    pattern: Pattern | None = None

    @model_validator(mode="after")
    def _exactly_one(self) -> Positions:
        if bool(self.points) == bool(self.pattern):
            raise ValueError("give exactly one of points, file and pattern")
        return self

    def marks(self, joint: Joint) -> Matrix:
        """(k, 2) coordinates in mm."""
        if self.pattern is None:
            return np.array(self.points)
        x = _spread(joint.junction.length, self.pattern.edge, self.pattern.columns)
        y = _spread(joint.junction.width, self.pattern.edge, self.pattern.rows)
        X, Y = np.meshgrid(x, y)
        return np.column_stack([X.ravel(), Y.ravel()])

    def faults(self, joint: Joint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        length, width = joint.junction.length, joint.junction.width
        if pattern := self.pattern:
            spread = [size for size, n in ((length, pattern.columns), (width, pattern.rows)) if n > 1]
            if 2 * pattern.edge > min(spread, default=np.inf):
                yield "pattern.edge", pattern.edge, f"at most half the junction, {min(spread) / 2:g} mm"
            return
        allowed = f"on the junction, 0 … {length:g} × 0 … {width:g} mm"
        for k, (x, y) in enumerate(self.points):
            if not (0 <= x <= length and 0 <= y <= width):
                yield f"points[{k}]", [x, y], allowed

    def nearest_nodes(self, joint: Joint) -> Indices:
        """The junction node nearest to each point, at most half a node spacing away along x and y."""
        nx, _ = joint.junction.nodes
        positions = self.marks(joint)
        ix, iy = (
            np.abs(positions[:, [axis]] - grid).argmin(axis=1) for axis, grid in enumerate((joint.x, joint.y))
        )
        return np.asarray(iy * nx + ix)


def _spread(size: float, edge: float, count: int) -> Vector:
    """`count` points from edge to size − edge; a single one in the middle."""
    return np.linspace(edge, size - edge, count) if count > 1 else np.array([size / 2])
