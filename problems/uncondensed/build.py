"""From a scene to the sparse form's matrices and loads. Nothing is condensed, nothing is stored.

scene → finite elements of each part, springs between them → Assembly (K̂, B), f̂, g
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from problems.errors import InputError
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.prepared import Prepared
from problems.forms.stages import SparseStages
from problems.model.scene import JointScene, MadeScene, MatricesScene, Scene
from problems.storage.cache import digest
from problems.storage.fingerprint import fingerprint

from .whole_model import WholeModel

WORTH = 0.5  # of the work on the inverse near the diagonal: a coarser model that saves less is none
DENSEST = 0.25  # of a block's entries: a denser K gains nothing from this form
SMALL = 200  # unknowns up to which any K is taken


def prepared(scene: Scene) -> Prepared:
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
    key = digest("uncondensed", scene.assembly_key, fingerprint([Path(__file__)], within=folders))
    own = isinstance(scene, MatricesScene)
    stages = SparseStages(key, time.perf_counter() - start, scene.source_of, own)
    return Prepared(assembly, stages, coarser=coarser)


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
    K = assembly.K.as_sparse(assembly.nodes)
    for block in K.blocks:
        share = block.matrix.nnz / block.size**2
        if block.size > SMALL and share > DENSEST:
            allowed = f"at most {DENSEST:.0%} of a block's entries; K is dense: use --form dual or primal"
            raise InputError.one(scene.source_of("K"), "nonzero entries of K", f"{share:.0%}", allowed)
    return replace(assembly, K=K)
