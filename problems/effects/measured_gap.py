"""Measured gap: values measured at points, interpolated to the contacts."""

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

from problems.forms.assembly import Vector
from problems.input.bounded import Finite
from problems.model.effect import ContactEffect, Effect, GapEffect, Pair, at_contacts
from problems.model.interface import AnyJoint
from problems.model.joint import Faults


class MeasuredGap(ContactEffect, GapEffect):
    """g += linear interpolation of the points (x, y, gap) in mm, from `file`, a CSV with these columns.

    Linear on the Delaunay triangles of the points; outside their convex hull, the gap of the nearest point.
    Points may lie outside the junction.
    """

    columns: ClassVar[tuple[str, ...]] = ("x", "y", "gap")
    points: Annotated[tuple[tuple[Finite, Finite, Finite], ...], Field(min_length=3), "mm"]

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        places = np.array(self.points)[:, :2]
        if np.linalg.matrix_rank(places - places.mean(axis=0), tol=1e-9 * np.ptp(places)) < 2:
            yield "points", "all on one line", "at least three points off a line"
        _, first, count = np.unique(places, axis=0, return_index=True, return_counts=True)
        for k in first[count > 1]:
            yield f"points[{k}]", list(self.points[k]), "one gap per point; this point appears twice"
        for other in others:
            if isinstance(other, MeasuredGap) and set(self.pairs(joint)) & set(other.pairs(joint)):
                yield "between", self.between, "one measured_gap per contact: another one covers this contact"

    def unusual(self, joint: AnyJoint) -> Faults:
        if (mean := float(np.mean(self.points, axis=0)[2])) < 0:
            yield "points, their mean gap", mean, "0 mm or more: the parts would overlap"

    def gap(self, joint: AnyJoint) -> Vector:
        points = np.array(self.points)
        places, values = points[:, :2], points[:, 2]
        inside, nearest = LinearNDInterpolator(places, values), NearestNDInterpolator(places, values)

        def at(pair: Pair) -> Vector:
            nodes = joint.places(pair)
            found = inside(nodes)
            beyond = np.isnan(found)
            found[beyond] = nearest(nodes[beyond])
            return np.asarray(found)

        return at_contacts(at, self.pairs(joint), joint)
