"""Effects at positions: points on the junction, between its nodes too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from problems.forms.assembly import Matrix, Vector
from problems.input.bounded import Finite, NotNegative

from .effect import Effect, ForceEffect
from .joint import Faults, Joint, Table

FORCES = ("preload", "clamping_force")  # keys of the effects that press at points
TEARS = 400.0  # N/mm² of the square of a thickness: the yield stress of an aluminium alloy


class Pattern(Table):
    """columns × rows points, evenly spaced over the junction up to `edge` mm from its border.

    on_nodes : each is moved to the nearest node of the junction.
    """

    columns: Annotated[int, Field(ge=1, le=10_000)]
    rows: Annotated[int, Field(ge=1, le=10_000)]
    edge: Annotated[NotNegative, "mm"] = 0.0
    on_nodes: Annotated[bool, Field(exclude_if=lambda value: not value)] = False


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
        if self.pattern.on_nodes:
            x, y = (grid[abs(at[:, None] - grid).argmin(axis=1)] for at, grid in ((x, joint.x), (y, joint.y)))
        X, Y = np.meshgrid(x, y)
        return np.column_stack([X.ravel(), Y.ravel()])

    def unusual(self, joint: Joint) -> Faults:
        thinnest = min(part.thickness for part in joint.part)
        for key in FORCES:
            force, most = getattr(self, key, 0.0), TEARS * thinnest**2
            if force > most:
                yield key, force, f"at most {most:g} N on {thinnest:g} mm: it would tear the part"

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


def _spread(size: float, edge: float, count: int) -> Vector:
    """`count` points from edge to size − edge; a single one in the middle."""
    return np.linspace(edge, size - edge, count) if count > 1 else np.array([size / 2])
