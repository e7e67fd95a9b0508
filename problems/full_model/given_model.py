"""Matrices that are given, a user's or manufactured: there is nothing to condense."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from problems.errors import InputError
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.problem import Progress, silent
from problems.forms.stages import DensePrepared, SparsePrepared
from problems.model.effect import Effect
from problems.model.scene import ManufacturedScene, MatricesScene
from problems.storage.cache import digest
from problems.storage.fingerprint import fingerprint

DENSEST = 0.25  # of a block's entries: a denser K gains nothing from the sparse form
SMALL = 200  # unknowns up to which any K is taken
CODE = ("problems/model", "problems/full_model", "problems/input", "problems/formats")


@dataclass(frozen=True)
class GivenModel:
    """As JointModel, of the scene's own K, A, f and g."""

    scene: MatricesScene | ManufacturedScene

    @classmethod
    def of(cls, scene: MatricesScene | ManufacturedScene) -> GivenModel:
        """Raises InputError if contacts of a rung depend on one another; a user's are checked when read."""
        if isinstance(scene, ManufacturedScene):
            from problems.input.dependent_contacts import refuse_dependent

            refuse_dependent(scene.made.assembly.A, scene.source_of("A"))
        return cls(scene)

    def sparse(self) -> SparsePrepared:
        """Raises InputError also if K is dense."""
        start, scene = time.perf_counter(), self.scene
        given, *_ = self._given(sparse=True)
        K = given.K.as_sparse(given.nodes)
        for block in K.blocks:
            share = block.matrix.nnz / block.size**2
            if block.size > SMALL and share > DENSEST:
                allowed = f"at most {DENSEST:.0%} of a block's entries; K is dense: use --form dual or primal"
                raise InputError.one(scene.source_of("K"), "nonzero entries of K", f"{share:.0%}", allowed)
        seconds = time.perf_counter() - start
        key = digest("sparse", scene.assembly_key, fingerprint([Path(__file__)], CODE))
        own = isinstance(scene, MatricesScene)
        return SparsePrepared(replace(given, K=K), key, seconds, scene.source_of, own)

    def dense(self, progress: Progress = silent) -> DensePrepared:
        given, _, seconds, key = self._given(sparse=False)
        K = given.K.as_dense()
        if K is not given.K:
            given = replace(given, K=K, parts=tuple(f"part {k + 1}" for k in range(len(K.blocks))))
        return DensePrepared(given, key, {"condensation": seconds}, self.scene.source_of, progress)

    def load_case(self, sparse: bool, effects: Iterable[Effect] | None = None) -> LoadCase:
        return self._given(sparse)[1]

    @property
    def built(self) -> bool:
        return self.dense().built

    def _given(self, sparse: bool) -> tuple[Assembly, LoadCase, float, str]:
        """The matrices and loads, the seconds that reading them took, and their key."""
        scene = self.scene
        if isinstance(scene, ManufacturedScene):
            return scene.made.assembly, scene.made.load, 0.0, scene.assembly_key
        from problems.input.stored_matrices import stored_matrices  # only for own matrices

        return stored_matrices(dict(scene.files), scene.assembly_key, sparse)
