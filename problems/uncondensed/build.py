"""From a scene to the sparse form's matrices and loads. Nothing is condensed, nothing is stored.

scene → finite elements of each part, springs between them → Assembly (K̂, B), f̂, g
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import scipy.sparse as sp

from problems.errors import InputError
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.sparse_factor import Factor, NotPositiveDefinite
from problems.forms.sparse_prepared import SparsePrepared
from problems.model.scene import JointScene, MadeScene, MatricesScene, Scene
from problems.storage.cache import digest
from problems.storage.fingerprint import fingerprint

from .whole_model import WholeModel

WORTH = 0.5  # of the work on the inverse near the diagonal: a coarser model that saves less is none
DENSEST = 0.25  # of a block's entries: a denser K gains nothing from this form
LARGEST_CONDITION = 1e14  # beyond it no digit of a displacement can be proven
SMALL = 200  # unknowns up to which any K is taken


def prepared(scene: Scene) -> SparsePrepared:
    """K̂ and B of a scene. Raises InputError if K is dense or cannot be read, and where factors are first
    needed if it is not positive definite.
    """
    start = time.perf_counter()
    coarser: Callable[[], Assembly] | None = None
    folders: tuple[str, ...] = ("problems/fem", "problems/model", "problems/effects", "problems/uncondensed")
    match scene:
        case JointScene():
            model = WholeModel.of(scene)
            assembly = model.assembly()
            graded = model.graded()
            if graded.work < WORTH * model.work:
                coarser = graded.assembly
        case MatricesScene():
            assembly = _sparse(_own(scene)[0], scene)
            folders += ("problems/input", "problems/formats")
        case MadeScene():
            assembly = _sparse(scene.made.assembly, scene)
        case _:
            raise TypeError(type(scene).__name__)
    seconds = {"model": time.perf_counter() - start}
    return _OfScene(scene, folders, assembly, seconds, coarser)


class _OfScene(SparsePrepared):
    """Says of a mechanism where it moves, as an error of the scene, and refuses a nearly singular own K.

    folders : of the code that made K.
    """

    def __init__(self, scene: Scene, folders: tuple[str, ...], *given: Any) -> None:
        super().__init__(*given)
        self.scene, self.folders = scene, folders

    @cached_property
    def key(self) -> str:
        code = fingerprint([Path(__file__)], within=self.folders)
        return digest("uncondensed", self.scene.assembly_key, code)

    @cached_property
    def sparse_factors(self) -> tuple[Factor, ...]:
        try:
            found = super().sparse_factors
        except NotPositiveDefinite as error:
            from problems.forms.stages import indefinite  # which imports the code of dense factors

            nodes, unknown = self.assembly.nodes, error.unknown
            where = "" if nodes is None else " at ({:g}, {:g}) mm".format(*nodes[unknown])
            key, moves = f"x[{unknown}]{where}", "moves without a force"
            raise indefinite(self.scene.source_of("K"), key, moves) from error
        if isinstance(self.scene, MatricesScene):
            self.__dict__["sparse_factors"] = found  # which the condition number needs
            if self.condition > LARGEST_CONDITION:
                from problems.forms.stages import indefinite

                raise indefinite(self.scene.source_of("K"), "cond(K), in balanced units", self.condition)
        return found


def load_case(scene: Scene) -> LoadCase:
    """f̂ (N,) and g (m,) of a scene."""
    match scene:
        case JointScene():
            return WholeModel.of(scene).load_case()
        case MatricesScene():
            return _own(scene)[1]
        case MadeScene():
            return scene.made.load
    raise TypeError(type(scene).__name__)


def _own(scene: MatricesScene) -> tuple[Assembly, LoadCase]:
    from problems.input.stored_matrices import stored_matrices  # only for own matrices

    assembly, load, _, _ = stored_matrices(dict(scene.files), scene.assembly_key, sparse=True)
    return assembly, load


def _sparse(assembly: Assembly, scene: Scene) -> Assembly:
    blocks = tuple(sp.csc_array(K) for K in assembly.blocks)
    for K in blocks:
        share = K.nnz / K.shape[0] ** 2
        if K.shape[0] > SMALL and share > DENSEST:
            allowed = f"at most {DENSEST:.0%} of a block's entries; K is dense: use --form dual or primal"
            raise InputError.one(scene.source_of("K"), "nonzero entries of K", f"{share:.0%}", allowed)
    return Assembly(blocks, assembly.A, assembly.nodes, assembly.parts, assembly.notes)
