"""Installed fasteners: springs that tie the two parts of a contact together."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import Vector
from problems.input.bounded import Finite, Positive
from problems.model.effect import ContactEffect, Effect, Pair, SpringEffect
from problems.model.joint import TOOL, Faults, Joint
from problems.model.positions import Positions


class InstalledFasteners(Positions, ContactEffect, SpringEffect):
    """½ k (x_a − x_b − approach)² for each fastener: K += k t tᵀ, f += k · approach · t, t = e_a − e_b.

    stiffness k in N/mm along the fastener's axis; the default is an estimate, EA/L of a 6 mm aluminium
    shank through 20 mm. approach in mm: by how much the gap was reduced when the fastener was set; 0 keeps
    the gap as it was, the value of the initial gap keeps it closed. Each fastener acts on the nearest
    junction node.
    """

    stiffness: Annotated[Positive, "N/mm"] = 1e5
    approach: Annotated[Finite, "mm"] = 0.0

    def faults(self, joint: Joint, others: Sequence[Effect] = ()) -> Faults:
        yield from super().faults(joint, others)
        if joint.pairs and not self._tied(joint):
            yield "between", self.between, "a contact of two parts; a fastener cannot tie a part to the tool"
        # A hole holds one element: no two ties, nor a tie and a preload, at one node of one contact.
        mine = set(self.nearest_nodes(joint))
        for other in others:
            if isinstance(other, Positions):
                shared = mine & set(other.nearest_nodes(joint))
                crossed = other.pairs(joint) if isinstance(other, ContactEffect) else joint.pairs
                if shared and set(self._tied(joint)) & set(crossed):
                    where = [joint.nodes[node].tolist() for node in sorted(shared)]
                    yield "points", where, f"separate nodes: {other.kind} acts at the same nodes"

    def _tied(self, joint: Joint) -> list[Pair]:
        return [pair for pair in self.pairs(joint) if pair[1] != TOOL]

    def springs(self, joint: Joint) -> tuple[sp.csc_array, Vector]:
        nodes, pairs = self.nearest_nodes(joint), self._tied(joint)
        starts = np.array([[joint.unknowns(part).start for part in pair] for pair in pairs])
        ends = (starts[:, None, :] + nodes[:, None]).ravel()
        r = len(ends) // 2
        entries = (np.tile([1.0, -1.0], r), (ends, np.arange(r).repeat(2)))
        return sp.csc_array(sp.coo_array(entries, shape=(joint.size[0], r))), np.full(r, self.stiffness)

    def force(self, joint: Joint) -> Vector:
        T, k = self.springs(joint)
        return T @ (k * self.approach)
