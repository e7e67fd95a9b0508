"""A superelement of our own: a part's plate, condensed onto chosen nodes of its mesh in the junction.

Of each kept node (k, 3) the deflection w is an unknown, or w and the rotations w_y about x and −w_x about y.
Everything else, the plate beyond the junction included, is condensed: S = K_jj − K_ji K_ii⁻¹ K_ij.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from problems import storage
from problems.forms.assembly import Indices, Matrix, Vector
from problems.storage import fingerprint

from .condensation import condensed_onto, part_key
from .joint import Joint
from .node_table import Nodes
from .part import PartModel
from .superelement import Superelement
from .superelement_rows import NORMAL_ALONE, by_order

WITH_ROTATIONS = (3, 4, 5)


@dataclass(frozen=True, eq=False)
class CondensedPlate:
    """The StiffnessSource of the only part of a joint.

    kept (k,) : the junction nodes that stay, numbered as in the joint. dofs : (3,), or (3, 4, 5).
    """

    joint: Joint
    kept: Indices
    dofs: tuple[int, ...] = NORMAL_ALONE

    @property
    def part(self) -> PartModel:
        """The finite elements of the part."""
        return PartModel.of(self.joint, self.joint.part[0], ())

    @property
    def key(self) -> str:
        code = fingerprint([Path(__file__)])
        return storage.digest(part_key(self.part), self.kept.tolist(), self.dofs, code)

    def stored(self) -> storage.Entry:
        return storage.load_or_make(
            self.key, lambda: ({"K": self._condensed()}, {"notes": [], "sparse": False})
        )

    def unknowns(self, part: PartModel) -> tuple[Indices, Vector]:
        """The plate's unknowns that are the kept ones, node by node, and their signs."""
        w = part.deflections[self.kept]
        row = 2 * len(part.plate.x)  # unknowns of w and w_x, or of w_y and w_xy
        of_dof = {3: (w, 1.0), 4: (w + row, 1.0), 5: (w + 1, -1.0)}
        places, signs = zip(*(of_dof[dof] for dof in self.dofs), strict=True)
        return np.stack(places, axis=1).ravel(), np.tile(signs, len(w))

    def _condensed(self) -> Matrix:
        part = self.part
        unknowns, signs = self.unknowns(part)
        K = condensed_onto(unknowns, part)
        K *= signs
        K *= signs[:, None]
        return K

    def superelement(self, file: Path, height: float) -> Superelement:
        """The part, its nodes `height` mm above the plane. file : the scene, for messages."""
        count = len(self.kept)
        xyz = np.column_stack([self.joint.nodes[self.kept], np.full(count, height)])
        up, every = np.tile([0.0, 0.0, 1.0], (count, 1)), np.arange(count)
        nodes = Nodes(every + 1, xyz, up, np.ones(count, dtype=bool), every)
        part = self.joint.part[0]
        content = storage.digest(self.part.geometry, self.kept.tolist(), self.dofs, height)
        node, dof = by_order("table", nodes, self.dofs)
        return Superelement(part.name, file, content, self, self.dofs, nodes, node, dof)
