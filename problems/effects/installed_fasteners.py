"""Installed fasteners: springs that tie the two parts of a contact together."""

from collections.abc import Sequence
from typing import Annotated, ClassVar

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Vector
from problems.input.bounded_types import Positive
from problems.model.effect import Effect, SpringEffect
from problems.model.interface import AnyJoint, across
from problems.model.joint import TOOL, Faults, Pair
from problems.model.junction_terms import sides
from problems.model.positions import Positions


class InstalledFasteners(Positions, SpringEffect):
    """K += k t tᵀ, f += (preload + k · approach) t, t = w_a − w_b, for each fastener.

    It is a spring that pulls its parts together with preload + k (approach − tᵀx). stiffness k in N/mm along
    the fastener's axis; the default is an estimate, EA/L of a 6 mm aluminium shank through 20 mm. approach in
    mm: by how much the gap was reduced when the fastener was set; 0 keeps the gap as it was, the value of the
    initial gap keeps it closed. A stage that sets the fastener locks what it has reached. preload in N: the
    force that the fastener keeps where it is set. Each fastener acts where it is: w_a and w_b are the weights
    of its place on the nodes of each part around it, along the normal of the first.
    """

    more_columns: ClassVar[tuple[str, ...]] = ("preload",)
    stiffness: Annotated[Positive, "N/mm"] = 1e5

    def faults(self, joint: AnyJoint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        if joint.pairs and not self.tied(joint):
            yield "between", self.between, "a contact of two parts; a fastener cannot tie a part to the tool"

    def tied(self, joint: AnyJoint) -> list[Pair]:
        return [pair for pair in self.pairs(joint) if pair[1] != TOOL]

    def springs(self, joint: AnyJoint) -> tuple[sp.csc_array, Vector]:
        points, columns = self.marks(joint), []
        for pair in self.tied(joint):
            rows = {part: sign * joint.deflection(part, points, pair[0]) for part, sign in sides(pair)}
            columns.append(across(joint, rows, len(points)).T)
        T = sp.csc_array(sp.hstack(columns))
        T.sort_indices()
        return T, np.full(T.shape[1], self.stiffness)
