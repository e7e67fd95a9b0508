"""Measured gap: values measured at points, interpolated to the contacts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from problems.forms.assembly import Matrix, Vector
from problems.input.bounded_types import Finite
from problems.input.scan_points import crowded, too_small, unlike
from problems.model.effect import ContactEffect, Effect, GapEffect
from problems.model.interface import AnyJoint
from problems.model.joint import Faults
from problems.model.junction_terms import at_contacts
from problems.model.surface import Triangles


class MeasuredGap(ContactEffect, GapEffect):
    """g += interpolation of the points (x, y, gap) in mm, from `file`, a CSV with these columns.

    Linear on Delaunay's triangles of the points, bilinear on rectangles, the same whatever the order of the
    points; outside their convex hull, the gap of the nearest point. Points may lie outside the junction.
    """

    columns: ClassVar[tuple[str, ...]] = ("x", "y", "gap")
    points: Annotated[tuple[tuple[Finite, Finite, Finite], ...], Field(min_length=3), "mm"]

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        places = np.array(self.points)[:, :2]
        if np.linalg.matrix_rank(places - places.mean(axis=0), tol=1e-9 * np.ptp(places)) < 2:
            yield "points", "all on one line", "at least three points off a line"
        for first, k in crowded(places):
            allowed = f"one gap per point; this point appears twice, see {self.point_name(k)}"
            yield f"points[{first}]", list(self.points[first]), allowed
        for other in others:
            if isinstance(other, MeasuredGap) and set(self.pairs(joint)) & set(other.pairs(joint)):
                yield "between", self.between, "one measured_gap per contact: another one covers this contact"

    def unusual(self, joint: AnyJoint) -> Faults:
        points = np.array(self.points)
        if (mean := float(points[:, 2].mean())) < 0:
            yield "points, their mean gap", mean, "0 mm or more: the parts would overlap"
        for k, usual in unlike(points):
            yield f"gap, {self.point_name(k)}", self.points[k][2], usual
        beyond = self.beyond(joint)
        if count := int((beyond > 0).sum()):
            metres = too_small(points[:, :2], joint.bounds)
            value = f"{count} of {len(beyond)}, up to {beyond.max():.4g} mm away{metres}"
            yield "contacts beyond the points", value, "none: they take the gap of the nearest point"

    def beyond(self, joint: AnyJoint) -> Vector:
        return at_contacts(lambda pair: self._at(joint.places(pair))[1], self.pairs(joint), joint)

    def gap(self, joint: AnyJoint) -> Vector:
        return at_contacts(lambda pair: self._at(joint.places(pair))[0], self.pairs(joint), joint)

    def _at(self, nodes: Matrix) -> tuple[Vector, Vector]:
        """The gaps at nodes (c, 2), and the distance of each from the nearest point if it is beyond these."""
        surface, gaps = _surface(self.points)
        distance, nearest = surface.tree.query(nodes - surface.middle)
        W = surface.weights(nodes)
        outside = W.sum(axis=1) == 0
        return np.where(outside, gaps[nearest], W @ gaps), np.where(outside, distance, 0.0)


@lru_cache(maxsize=2)
def _surface(points: tuple[tuple[float, float, float], ...]) -> tuple[Triangles, Vector]:
    """The surface through the points, and their gaps in the order of its nodes."""
    ordered = np.array(points)
    ordered = ordered[np.lexsort(ordered.T[::-1])]
    return Triangles.of(ordered[:, :2], holes=False), ordered[:, 2]
