"""Shims: a sheet, even or tapered, fills the gap over a rectangle or a polygon."""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from problems.forms.assembly import Mask, Matrix, Vector
from problems.input.bounded_types import Finite, Positive, Range
from problems.model.effect import ContactEffect, Effect, GapEffect, OneOr
from problems.model.interface import AnyJoint, places_of
from problems.model.joint import Faults, Pair
from problems.model.junction_terms import at_contacts
from problems.model.surface_cells import cross

NUDGE = 1e-6  # mm: the places of nodes are rounded; of an outline, to the left and below
Outline = Annotated[tuple[tuple[Finite, Finite], ...], Field(min_length=3, exclude_if=lambda some: not some)]
AT_ONCE = 2**19  # places times corners


class Shims(ContactEffect, GapEffect):
    """g −= thickness at every contact with x and y in the ranges, borders included, or in the outline; mm.

    A contact on the border of an outline belongs to what is left of and below it, as far as there is a
    junction: of outlines that touch one has it. Two thicknesses are those at the ends of the longer range,
    and it is linear between. A shim is rigid. One thicker than the gap holds the parts apart; overlapping
    shims add up. Rectangles that touch would both fill the contacts on their common border and are refused.
    """

    thickness: Annotated[OneOr[Positive, tuple[Positive, Positive]], "mm"]
    x: Annotated[Range | None, "mm"] = None
    y: Annotated[Range | None, "mm"] = None
    outline: Annotated[Outline, "mm"] = ()

    @model_validator(mode="after")
    def _exactly_one(self) -> "Shims":
        if {self.x is None, self.y is None} != {bool(self.outline)}:
            raise ValueError("give x and y, or outline")
        return self

    @property
    def ranges(self) -> Matrix:
        """(2, 2) the least and the largest x, and y, mm."""
        if self.x is not None and self.y is not None:
            return np.array([self.x, self.y])
        return np.array([(min(values), max(values)) for values in zip(*self.outline, strict=True)])

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        if any(self._crossed()):
            yield "outline", list(self.outline), "corners in their order around it: two of its edges cross"
        places = places_of(joint, (pair for pair in self.pairs(joint) if pair in joint.pairs))
        if len(places) and not self.covers(places, joint).any():
            x, y = places[((places - self.ranges.mean(axis=1)) ** 2).sum(axis=1).argmin()]
            yield "x, y", self.ranges.tolist(), f"ranges with a node; the nearest: at {x:g}, {y:g} mm"
        for other in (other for other in others if isinstance(other, Shims)):
            for x, y in self._on_borders(other, joint)[:1]:
                both = f"no common border with other shims: both fill the contact at {x:g}, {y:g} mm"
                value = list(self.outline) or self.ranges.tolist()
                yield "outline" if self.outline else "x, y", value, f"{both}; of outlines one does"

    def _on_borders(self, other: "Shims", joint: AnyJoint) -> Matrix:
        """(k, 2) the contacts that both shims cover although they only touch there."""
        pairs = [pair for pair in self.pairs(joint) if pair in joint.pairs and pair in other.pairs(joint)]
        places = places_of(joint, pairs)
        places = places[self.covers(places, joint) & other.covers(places, joint)]
        around = [places + 10 * NUDGE * np.array(side) for side in product((-1, 1), repeat=2)]
        apart = [~(self.covers(at, joint) & other.covers(at, joint)) for at in around]
        return places[np.all(apart, axis=0)]

    def _crossed(self) -> Iterator[bool]:
        """Yield of each edge of the outline whether another one passes through it."""
        start, stop = np.reshape(self.outline, (-1, 2)), np.roll(self.outline, -1, axis=0)
        for a, b in zip(start, stop, strict=True):
            side, (first, last) = cross(b - a, start - a), (cross(stop - start, p - start) for p in (a, b))
            yield bool(((side * np.roll(side, -1) < 0) & (first * last < 0)).any())

    def covers(self, places: Matrix, joint: AnyJoint) -> Mask:
        """(k,) which places are in the rectangle, or in the polygon: a ray from them to the right crosses its
        border an odd number of times.
        """
        if not self.outline:
            low, high = self.ranges.T
            return np.asarray(((low - NUDGE <= places) & (places <= high + NUDGE)).all(axis=1))
        corners, (low, high) = np.array(self.outline), joint.bounds
        edge, at = np.roll(corners, -1, axis=0) - corners, np.clip(places - NUDGE, low + NUDGE, high - NUDGE)
        inside = ((corners.min(axis=0) <= at) & (at <= corners.max(axis=0))).all(axis=1)
        near = np.flatnonzero(inside)
        for some in np.array_split(near, len(near) * len(corners) // AT_ONCE + 1):
            above = at[some, 1, None] >= corners[:, 1]
            right = (cross(edge, at[some, None] - corners) > 0) == (edge[:, 1] > 0)
            inside[some] = ((above != np.roll(above, -1, axis=1)) & right).sum(axis=1) % 2 == 1
        return np.asarray(inside)

    def along(self, places: Matrix) -> Vector:
        """Where places (k, 2), mm, are on the longer range: 0 at its start, 1 at its stop."""
        axis = int(np.ptp(self.ranges, axis=1).argmax())
        start, stop = self.ranges[axis]
        return np.clip((places[:, axis] - start) / (stop - start), 0.0, 1.0)

    def gap(self, joint: AnyJoint) -> Vector:
        first, last = np.resize(self.thickness, 2)

        def filled(pair: Pair) -> Vector:
            places = joint.places(pair)
            thickness = first + (last - first) * self.along(places)
            return np.where(self.covers(places, joint), -thickness, 0.0)

        return at_contacts(filled, self.pairs(joint), joint)
