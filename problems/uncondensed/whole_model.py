"""The finite-element model of a joint, all parts with all their unknowns, and its loads.

    min ½ûᵀK̂û − f̂ᵀû   subject to   Bᵀû ≤ g

Condensation is exact: û at the junction is x, and the multipliers λ are those of min ½xᵀKx − fᵀx, Aᵀx ≤ g.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from problems.forms.assembly import Assembly, LoadCase
from problems.model.effect import TieEffect
from problems.model.joint import Joint
from problems.model.part import PartModel
from problems.model.part_load import PartLoadEffect
from problems.model.scene import JointScene
from problems.stiffness.operator import Stiffness

from .graded import graded
from .numbering import Numbering, Unknowns


@dataclass(frozen=True)
class WholeModel:
    """The parts of a scene as finite elements, and their numbering."""

    scene: JointScene
    models: tuple[PartModel, ...]
    numbering: Numbering

    @classmethod
    def of(cls, scene: JointScene) -> WholeModel:
        joint = scene.joint
        models = tuple(PartModel.of(joint, part, scene.stiffness_effects) for part in joint.part)
        return cls(scene, models, Numbering.of(models, _tied_parts(scene)))

    def graded(self) -> WholeModel:
        """A coarser model with the same junction, for a preconditioner."""
        models = tuple(map(graded, self.models))
        return WholeModel(self.scene, models, Numbering.of(models, self.numbering.blocks))

    @property
    def work(self) -> float:
        """What the inverse near the diagonal costs, as far as it depends on the grid lines: Σ (lines)³."""
        return float(sum(len(model.free_lines) ** 3 for model in self.models))

    @cached_property
    def junction(self) -> Unknowns:
        """(n,) the numbers of the junction's deflections, in the order of x."""
        places = zip(self.numbering.places, self.models, strict=True)
        return np.concatenate([place[model.deflections] for place, model in places])

    def assembly(self) -> Assembly:
        """K̂, a sparse block for each part or for parts that springs join, and B (N, m)."""
        springs = [effect.springs(self.scene.joint) for effect in self.scene.effects_of(TieEffect)]
        blocks, names = [], []
        ends = np.cumsum([0, *self.numbering.sizes])
        for parts, start, stop in zip(self.numbering.blocks, ends[:-1], ends[1:], strict=True):
            K = self._block(parts, int(start), int(stop - start))
            for T, k in springs:
                T_here = self._at_junction(T)[start:stop]
                added = T_here @ sp.diags_array(k) @ T_here.T
                K = K + (added + added.T) / 2  # the order of products is another in K_ji: proofs see it
            blocks.append(sp.csc_array(K))
            names.append(" + ".join(self.scene.joint.part[part].name for part in parts))
        B = self._at_junction(self.scene.joint.contact_matrix())
        nodes = self._nodes()
        return Assembly(Stiffness.of(*blocks, nodes=nodes), B, nodes, tuple(names), junction=self.junction)

    def _block(self, parts: tuple[int, ...], start: int, size: int) -> sp.csc_array:
        """The stiffness of some parts, (size, size), on the unknowns from `start` on."""
        own = [self.models[part].stiffness() for part in parts]
        K = own[0] if len(own) == 1 else sp.csr_array(sp.block_diag(own, format="csr"))
        place = np.concatenate([self.numbering.places[part] for part in parts]).astype(np.int32) - start
        free = np.flatnonzero(place >= 0)
        order = np.empty(size, dtype=np.int32)
        order[place[free]] = free
        K = K[order]
        column, ends = place[K.indices], K.indptr
        if size < len(place):
            kept = column >= 0
            column, data, ends = column[kept], K.data[kept], np.append(0, np.cumsum(kept))[ends]
        else:
            data = K.data
        found = sp.csc_array((data, column, ends), shape=(size, size))  # symmetric
        found.sort_indices()
        return found

    def _at_junction(self, M: sp.csc_array) -> sp.csc_array:
        """(N, k): the rows of M (n, k) at the junction's deflections, the others zero."""
        M = sp.csc_array(M)
        found = sp.csc_array(
            (M.data, self.junction[M.indices], M.indptr), shape=(self.numbering.size, M.shape[1])
        )
        found.sort_indices()
        return found

    def load_case(self) -> LoadCase:
        """f̂ (N,), generalised forces in N, N·mm and N·mm², and g (m,) in mm."""
        f, g = self.scene.junction_load()
        whole = np.zeros(self.numbering.size)
        whole[self.junction] = f
        names = [part.name for part in self.scene.joint.part]
        for load in self.scene.effects_of(PartLoadEffect):
            part = names.index(load.part)
            place, force = self.numbering.places[part], load.load(self.models[part])
            whole[place[place >= 0]] += force[place >= 0]
        return LoadCase(whole, g)

    def _nodes(self) -> np.ndarray:
        """(N, 2) the coordinates of each unknown's node, mm."""
        nodes = np.empty((self.numbering.size, 2))
        for place, model in zip(self.numbering.places, self.models, strict=True):
            plate = model.plate
            iy, _, ix, _ = np.unravel_index(np.arange(plate.size), (len(plate.y), 2, len(plate.x), 2))
            nodes[place[place >= 0]] = np.column_stack([plate.x[ix], plate.y[iy]])[place >= 0]
        return nodes


def _tied_parts(scene: JointScene) -> list[list[int]]:
    """The parts of each block of K̂: parts that springs join are one block."""
    joint: Joint = scene.joint
    count = len(joint.part)
    linked = sp.lil_array((count, count))
    for effect in scene.effects_of(TieEffect):
        T = sp.csc_array(effect.springs(joint)[0])
        for column in range(T.shape[1]):
            parts = T.indices[T.indptr[column] : T.indptr[column + 1]] // joint.node_count
            linked[parts[0], parts] = 1
    _, label = connected_components(sp.csr_array(linked), directed=False)
    return [np.flatnonzero(label == k).tolist() for k in dict.fromkeys(label.tolist())]
