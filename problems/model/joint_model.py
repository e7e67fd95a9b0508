"""The finite-element model of a joint: its parts with all their unknowns, springs, contacts and loads.

    min ½ûᵀK̂û − f̂ᵀû   subject to   Bᵀû ≤ g

The sparse form is this problem. The dense forms condense it part by part onto the junction, which is exact: û
at the junction is x, and the multipliers λ are those of min ½xᵀKx − fᵀx, Aᵀx ≤ g.
"""

import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import ClassVar

import numpy as np
import scipy.sparse as sp

from problems import storage
from problems.forms.assembly import Assembly, Indices, LoadCase, Vector
from problems.forms.preparation_stages import DensePrepared, SparsePrepared, indefinite
from problems.reporter import SILENT, Reporter
from problems.stiffness.block import NotPositiveDefinite, SparseBlock
from problems.stiffness.operator import Stiffness
from problems.stiffness.sparse_block import sparse_block

from .banded_numbering import Numbering
from .effect import Effect
from .joint import Joint
from .junction_terms import junction_load
from .part import PartLoadEffect, PartModel, graded
from .scene import JointScene
from .springs import Springs

WORTH = 0.5  # of `work`: a coarser model that needs more is not used


@dataclass(frozen=True)
class JointModel:
    """The parts of a scene as finite elements. interiors : see `interior`, made when first needed."""

    scene: JointScene
    joint: Joint
    parts: tuple[PartModel, ...]
    interiors: dict[int, tuple[Indices, SparseBlock, sp.csr_array]] = field(default_factory=dict, repr=False)
    stored_sparse: ClassVar[None] = None  # no K is given
    dependent: ClassVar[bool] = False  # parts touch those beside them

    @classmethod
    def of(cls, scene: JointScene) -> "JointModel":
        joint = scene.joint
        assert isinstance(joint, Joint)
        parts = (PartModel.of(joint, part, scene.stiffness_effects) for part in joint.part)
        return cls(scene, joint, tuple(parts))

    def sparse(self) -> SparsePrepared:
        """K̂ and B. Raises InputError, where factors are first needed, if K̂ is not positive definite."""
        start = time.perf_counter()
        assembly, coarser = self.assembly(), self.graded()
        seconds = time.perf_counter() - start
        like = coarser.assembly if coarser.work < WORTH * self.work else None
        return SparsePrepared(assembly, seconds, self.scene.source_of, coarser=like)

    @property
    def built(self) -> bool:
        """Whether every dense matrix is in the cache; computes nothing."""
        from .condensation import part_key  # of the dense forms only

        keys = [*map(part_key, self.parts)]
        if self.springs:
            keys.append(self.springs.key(storage.digest(keys)))
        return None not in map(storage.load, keys) and self.dense().built

    def load_case(self, sparse: bool, effects: Iterable[Effect] | None = None) -> LoadCase:
        """f or f̂ (N,), generalised forces in N, N·mm and N·mm², and g (m,) in mm."""
        joint, acting = self.joint, self.scene.effects if effects is None else tuple(effects)
        f, g = junction_load(acting, joint)
        if sparse:
            at_junction, f = f, np.zeros(self.numbering.size)
            f[self.junction] = at_junction
        for load in (effect for effect in acting if isinstance(effect, PartLoadEffect)):
            k = joint.names.index(load.part)
            if sparse:
                place, force = self.numbering.places[k], load.load(self.parts[k])
                f[place[place >= 0]] += force[place >= 0]
            else:
                from .condensation import condensed_load  # of the dense forms only

                kept = load in self.scene.effects
                own = condensed_load(load, self.parts[k], partial(self.interior, k), kept)
                f[joint.unknowns(load.part)] += own
        return LoadCase(f, g)

    def graded(self) -> "JointModel":
        """A coarser model with the same junction, for a preconditioner."""
        return JointModel(self.scene, self.joint, tuple(map(graded, self.parts)))

    @property
    def work(self) -> float:
        """The cost of the inverse near the diagonal, as it grows with the mesh lines: Σ (lines)³."""
        return float(sum(len(part.free_lines) ** 3 for part in self.parts))

    @cached_property
    def springs(self) -> Springs:
        return Springs.of(self.scene)

    @cached_property
    def numbering(self) -> Numbering:
        return Numbering.of(self.parts, self.springs.groups)

    @cached_property
    def junction(self) -> Indices:
        """(n,) the numbers of the junction's deflections, in the order of x."""
        places = zip(self.numbering.places, self.parts, strict=True)
        return np.concatenate([place[part.deflections] for place, part in places])

    def assembly(self) -> Assembly:
        """K̂, a sparse block for each part or for parts that springs join, and B (N, m)."""
        blocks = []
        added = self._at_junction(self._at_junction(self.springs.added).T)
        ends = np.cumsum([0, *self.numbering.sizes])
        for parts, start, stop in zip(self.springs.groups, ends[:-1], ends[1:], strict=True):
            K = self._block(parts, int(start), int(stop - start))
            blocks.append(sp.csc_array(K + added[start:stop, start:stop] if self.springs else K))
        B, nodes = self._at_junction(self.joint.contact_matrix()), self._nodes()
        names = self._names(self.springs.groups)
        return Assembly(Stiffness.of(*blocks, nodes=nodes), B, nodes, names, junction=self.junction)

    def _names(self, blocks: Iterable[Iterable[int]]) -> tuple[str, ...]:
        return tuple(" + ".join(self.joint.part[part].name for part in parts) for parts in blocks)

    def _block(self, parts: list[int], start: int, size: int) -> sp.csc_array:
        """The stiffness of some parts, (size, size), on the unknowns from `start` on."""
        own = [self.parts[part].stiffness() for part in parts]
        K = own[0] if len(own) == 1 else sp.csr_array(sp.block_diag(own, format="csr"))
        place = np.concatenate([self.numbering.places[part] for part in parts]).astype(np.int32) - start
        free = np.flatnonzero(place >= 0)
        order = np.empty(size, dtype=np.int32)
        order[place[free]] = free
        K = K[order]
        column = place[K.indices]
        kept = column >= 0
        before = np.zeros(len(kept) + 1, dtype=np.int32)
        np.cumsum(kept, out=before[1:])
        entries = K.data[kept], column[kept], before[K.indptr]
        found = sp.csc_array(entries, shape=(size, size))  # symmetric
        found.sort_indices()
        return found

    def _at_junction(self, M: sp.sparray) -> sp.csc_array:
        """(N, k): the rows of M (n, k) at the junction's deflections, the others zero."""
        M = sp.csc_array(M)
        entries = M.data.copy(), self.junction[M.indices], M.indptr
        rows = sp.csc_array(entries, shape=(self.numbering.size, M.shape[1]))
        rows.sort_indices()
        return rows

    def _nodes(self) -> np.ndarray:
        """(N, 2) the coordinates of each unknown's node, mm."""
        nodes = np.empty((self.numbering.size, 2))
        for place, part in zip(self.numbering.places, self.parts, strict=True):
            plate = part.plate
            iy, _, ix, _ = np.unravel_index(np.arange(plate.size), (len(plate.y), 2, len(plate.x), 2))
            nodes[place[place >= 0]] = np.column_stack([plate.x[ix], plate.y[iy]])[place >= 0]
        return nodes

    def interior(self, k: int) -> tuple[Indices, SparseBlock, sp.csr_array]:
        """The unknowns i of a part that condensation eliminates, ordered for a narrow band, K_ii and K_ji."""
        if k not in self.interiors:
            part, K = self.parts[k], self.parts[k].stiffness()
            i = part.others[np.argsort(self.numbering.places[k][part.others])]
            self.interiors[k] = i, sparse_block(sp.csc_array(K[i][:, i])), K[part.deflections][:, i]
        return self.interiors[k]

    def part_unknowns(self, k: int, x: Vector) -> Vector:
        """(plate.size,) all unknowns of a part: zero where it is built in, inside it K_ii⁻¹(f_i − K_ij x_j).

        x : (n,) at the junction, or û (N,).
        """
        part, place = self.parts[k], self.numbering.places[k]
        u = np.zeros(part.plate.size)
        if len(x) == self.numbering.size:
            u[place >= 0] = x[place[place >= 0]]
            return u
        f = np.zeros(part.plate.size)
        for load in self.part_loads(k):
            f += load.load(part)
        u[part.deflections] = x[self.joint.unknowns(self.joint.part[k].name)]
        i, K_ii, _ = self.interior(k)
        b = (f - part.stiffness() @ u)[i]
        u[i] = K_ii.solve(b)
        u[i] += K_ii.solve(b - K_ii.multiply(u[i]))
        return u

    def part_loads(self, k: int) -> list[PartLoadEffect]:
        """The loads of the scene on a part."""
        name = self.joint.part[k].name
        return [load for load in self.scene.effects_of(PartLoadEffect) if load.part == name]

    def dense(self, reporter: Reporter = SILENT) -> DensePrepared:
        """K and A, from the cache or computed now; a dense block of K for each part, or for a range of parts
        that springs join. Raises InputError as `sparse` does.
        """
        from .condensation import condensed_stiffness, part_key  # of the dense forms only

        joint, source_of = self.joint, self.scene.source_of
        blocks, seconds, keys = [], {}, [*map(part_key, self.parts)]
        for part, key, own in zip(joint.part, keys, self.parts, strict=True):
            try:
                K, seconds[key] = condensed_stiffness(key, own, reporter, part.name)
            except NotPositiveDefinite as error:
                raise indefinite(source_of("K"), f"part.{part.name}", str(error)) from error
            blocks.append(K)
        groups, key = [[k] for k in range(len(blocks))], storage.digest(keys)
        spent = {"condensation": sum(seconds.values())}
        if self.springs:
            groups, key = self.springs.ranges, self.springs.key(key)
            blocks, spent["ties"] = self.springs.blocks(key, blocks, reporter)
        nodes = np.tile(joint.nodes, (len(joint.part), 1))
        assembly = Assembly(Stiffness.of(*blocks), joint.contact_matrix(), nodes, self._names(groups))
        return DensePrepared(assembly, key, spent, source_of, reporter)
