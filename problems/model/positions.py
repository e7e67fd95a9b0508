"""The base class of effects at points of the junction, at its nodes or between them."""

from collections.abc import Sequence
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from problems.forms.assembly import Matrix, Vector
from problems.input.bounded_types import PLAIN, Finite, NotNegative, Truth
from problems.input.scan_points import CLOSE, crowded

from .effect import ContactEffect, Effect, ForceEffect, SpringEffect
from .interface import AnyJoint, on_junction
from .joint import Faults, Table

FORCES = ("preload", "clamping_force")  # keys of the effects that press at points
MOST = 10_000  # points of a pattern
TEARS = 400.0  # N per mm² of thickness squared: the yield stress of an aluminium alloy


class Pattern(Table):
    """columns × rows points, evenly spaced over the junction up to `edge` mm from its border; at most MOST.

    on_nodes : whether each point is moved to the nearest node of the junction.
    """

    columns: Annotated[int, Field(ge=1, le=10_000), PLAIN]
    rows: Annotated[int, Field(ge=1, le=10_000), PLAIN]
    edge: Annotated[NotNegative, "mm"] = 0.0
    on_nodes: Truth = False

    @model_validator(mode="after")
    def _not_too_many(self) -> "Pattern":
        if self.columns * self.rows > MOST:
            raise ValueError(f"must be at most {MOST} points")
        return self


class Positions(ContactEffect, ForceEffect):
    """Forces at points of the contact `between`, by default of all.

    Parameters
    ----------
    points : sequence of (float, float)
        x and y of each point, mm; or `file`, a CSV with these columns.
    pattern : Pattern
        Columns and rows of points, in place of `points`.
    """

    columns: ClassVar[tuple[str, ...]] = ("x", "y")
    in_holes: ClassVar[bool] = True
    points: Annotated[tuple[tuple[Finite, Finite], ...], "mm"] = ()
    pattern: Pattern | None = None

    @model_validator(mode="after")
    def _exactly_one(self) -> "Positions":
        if bool(self.points) == bool(self.pattern):
            raise ValueError("give exactly one of points, file and pattern")
        return self

    def marks(self, joint: AnyJoint) -> Matrix:
        """(k, 2) the points, mm."""
        if self.pattern is None:
            return np.array(self.points)
        low, high = joint.bounds
        counts = self.pattern.columns, self.pattern.rows
        spread = zip(low, high - low, counts, strict=True)
        x, y = (start + _spread(size, self.pattern.edge, count) for start, size, count in spread)
        X, Y = np.meshgrid(x, y)
        places = np.column_stack([X.ravel(), Y.ravel()])
        if not self.pattern.on_nodes:
            return places
        nodes = joint.nodes_of(joint.names[0])
        at_x, at_y = np.ascontiguousarray(nodes.T)
        return nodes[[((at_x - x) ** 2 + (at_y - y) ** 2).argmin() for x, y in places]]

    def element_count(self, joint: AnyJoint) -> int:
        return self.pattern.columns * self.pattern.rows if self.pattern else len(self.points)

    def only(self, elements: Sequence[int], joint: AnyJoint) -> Self:
        count = self.element_count(joint)
        if len(elements) == count:
            return self
        places = tuple(map(tuple, self.marks(joint)[elements].tolist()))
        update: dict[str, object] = {"points": places, "pattern": None}
        for key in ("preload", "approach"):
            if isinstance(values := getattr(self, key, None), tuple):  # an approach has one for each pair
                update[key] = tuple(np.reshape(values, (-1, count))[:, elements].ravel().tolist())
        some = self.model_copy(update=update)
        for rows in ("_lines", "_stages"):
            if len(words := getattr(self, rows)) == count:
                setattr(some, rows, tuple(words[k] for k in elements))
        return some

    def unusual(self, joint: AnyJoint) -> Faults:
        thinnest = joint.thinnest
        for key in FORCES:
            force, most = np.max(getattr(self, key, 0.0)), TEARS * thinnest**2
            if force > most:
                yield key, force, f"at most {most:g} N on {thinnest:g} mm: it would tear the part"

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        length, width = np.diff(joint.bounds, axis=0)[0].tolist()
        if pattern := self.pattern:
            counts = (length, pattern.columns), (width, pattern.rows)
            spread = [(size, n - 1) for size, n in counts if n > 1]
            if any(size - 2 * pattern.edge <= CLOSE * n for size, n in spread):
                yield "pattern.edge", pattern.edge, f"less than half the junction, {min(spread)[0] / 2:g} mm"
                return
        marks = self.marks(joint)
        if isinstance(preload := getattr(self, "preload", None), tuple) and len(preload) != len(marks):
            yield "preload", list(preload), f"one number, or one for each of {len(marks)} points"
            return
        for k in np.flatnonzero(~joint.covers(self.parts(joint), marks)):
            yield f"points[{k}]" if self.points else "pattern", marks[k].tolist(), on_junction(joint)
        if pattern and (twins := crowded(marks)):
            place = marks[twins[0][1]].tolist()
            yield "pattern", place, "fewer columns or rows: several of its points are at this node"
        for first, twin in crowded(marks) if self.points and (self.in_holes or self._lines) else ():
            allowed = f"separate places: {self.point_name(first)} is there, too"
            yield f"points[{twin}]", marks[twin].tolist(), allowed
        # A hole holds one element: no two fasteners, and nothing else where one is installed.
        for other in others:
            alone = isinstance(self, SpringEffect) or (self.in_holes and type(other) is type(self))
            if alone and isinstance(other, Positions) and set(self.pairs(joint)) & set(other.pairs(joint)):
                both = crowded(np.vstack([marks, other.marks(joint)]))
                if shared := [marks[i].tolist() for i, k in both if i < len(marks) <= k]:
                    yield "points", shared, f"separate places: {other.kind} acts at the same ones"


def _spread(size: float, edge: float, count: int) -> Vector:
    """`count` points from edge to size − edge; a single one in the middle."""
    return np.linspace(edge, size - edge, count) if count > 1 else np.array([size / 2])
