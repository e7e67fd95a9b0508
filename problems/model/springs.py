"""Springs between the parts of a joint: K + T diag(k) Tᵀ, and the parts that they join into one block."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from problems import storage
from problems.forms.assembly import Matrix, Vector
from problems.reporter import Reporter, Stage
from problems.storage import fingerprint

from .effect import SpringEffect
from .scene import JointScene


@dataclass(frozen=True, eq=False)
class Springs:
    """The springs of a scene: directions T (n, r) and stiffnesses k (r,), N/mm.

    parts : the unknowns of each part, slices of x.
    """

    T: sp.csc_array
    k: Vector
    parts: tuple[slice, ...]

    @classmethod
    def of(cls, scene: JointScene) -> "Springs":
        """The springs of all effects of a scene; there may be none."""
        joint = scene.joint
        found = [effect.springs(joint) for effect in scene.effects_of(SpringEffect)]
        T = [sp.csc_array((joint.size[0], 0)), *(T for T, _ in found)]
        k = np.concatenate([np.zeros(0), *(k for _, k in found)])
        return cls(sp.csc_array(sp.hstack(T)), k, tuple(map(joint.unknowns, joint.names)))

    def __bool__(self) -> bool:
        return bool(len(self.k))

    @cached_property
    def groups(self) -> list[list[int]]:
        """The groups of parts that springs join: each is one block of K."""
        count, T = len(self.parts), self.T
        linked = sp.lil_array((count, count))
        if self:
            part = np.searchsorted([own.stop for own in self.parts], T.indices, side="right")
            linked[part[T.indptr[:-1]].repeat(np.diff(T.indptr)), part] = 1
        _, label = connected_components(sp.csr_array(linked), directed=False)
        return [np.flatnonzero(label == k).tolist() for k in dict.fromkeys(label.tolist())]

    @cached_property
    def ranges(self) -> list[list[int]]:
        """The parts of each dense block: consecutive ones, from the first to the last that springs join."""
        ranges: list[list[int]] = []
        for parts in sorted(self.groups):
            if ranges and parts[0] <= ranges[-1][-1]:
                ranges[-1] = list(range(ranges[-1][0], max(ranges[-1][-1], parts[-1]) + 1))
            else:
                ranges.append(list(range(parts[0], parts[-1] + 1)))
        return ranges

    def key(self, key: str) -> str:
        """The key of K with springs. key : of K without them."""
        T, k = self.T, self.k
        code = fingerprint([Path(__file__)])
        return storage.digest("springs", key, T.indices.tolist(), T.data.tolist(), k.tolist(), code)

    @cached_property
    def added(self) -> sp.csr_array:
        """T diag(k) Tᵀ (n, n), made symmetric to the last bit: products round differently in K_ji."""
        product = self.T @ sp.diags_array(self.k) @ self.T.T
        return sp.csr_array((product + product.T) / 2)

    def rows(self, group: Sequence[int]) -> slice:
        """The unknowns of consecutive parts."""
        return slice(self.parts[group[0]].start, self.parts[group[-1]].stop)

    def blocks(self, key: str, parts: Sequence[Matrix], reporter: Reporter) -> tuple[list[Matrix], float]:
        """The dense blocks of K with springs, one for each of `ranges`, and the seconds that they took.

        key : their key in the cache. parts : K of each part.
        """

        def made() -> storage.Entry:
            reporter.building(Stage.SPRINGS)
            start, arrays = time.perf_counter(), {}
            for b, group in enumerate(self.ranges):
                rows = self.rows(group)
                K = self.added[rows, rows].toarray(order="F")
                for part in group:
                    own = slice(self.parts[part].start - rows.start, self.parts[part].stop - rows.start)
                    K[own, own] += parts[part]
                arrays[f"K{b}"] = K
            return arrays, {"seconds": time.perf_counter() - start}

        arrays, facts = storage.load_or_make(key, made)
        return [arrays[f"K{b}"] for b in range(len(self.ranges))], facts["seconds"]
