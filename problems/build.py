"""From a scene to its model, and to the matrices and a load case of one form of its quadratic program.

The dense forms condense the model onto the junction; the sparse form takes it as it is. Only the code that a
form needs is imported.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias, cast

from problems.errors import InputError
from problems.forms import Form
from problems.forms.assembly import Assembly, LoadCase
from problems.forms.dependence import refuse_dependent
from problems.forms.preparation_stages import DensePrepared, SparsePrepared
from problems.forms.prepared import Prepared
from problems.input.matrix_entries import DENSEST
from problems.model.effect import Effect
from problems.model.joint import Joint
from problems.model.scene import JointScene, ManufacturedScene, MatricesScene, Scene
from problems.model.springs import Springs
from problems.model.stage_answers import stage_scenes
from problems.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from problems.model.joint_model import JointModel
    from problems.model.superelement_model import SuperelementModel

    Model: TypeAlias = "JointModel | SuperelementModel | GivenModel"

SMALL = 200  # unknowns up to which any K is taken


def model_of(scene: Scene) -> Model:
    """The model of a scene; that of a joint is made once and kept by the scene object.

    Raises InputError if the scene has stages.
    """
    if not isinstance(scene, JointScene):
        assert isinstance(scene, MatricesScene | ManufacturedScene)
        return GivenModel(scene)
    if scene.stages:
        names = [stage.name for stage in scene.stages]
        raise InputError.one(
            f"scene {scene.name}", "stage", names, "no stages here: each is a problem of its own"
        )
    if scene.model is None:
        if isinstance(scene.joint, Joint):
            from problems.model.joint_model import JointModel

            made: Model = JointModel.of(scene)
        else:
            from problems.model.superelement_model import SuperelementModel

            made = SuperelementModel.of(scene)
        object.__setattr__(scene, "model", made)
    model: Model = scene.model
    return model


def models_of(scene: Scene) -> list[Model]:
    """The model of each stage, or of the scene if it has none. Raises InputError, which names the stages."""
    if not isinstance(scene, JointScene):
        return [model_of(scene)]
    models, faults = [], []
    for name, part in stage_scenes(scene).items():
        try:
            models.append(model_of(part))
        except InputError as error:
            faults += error.in_stage(name).faults
    if faults:
        raise InputError(faults)
    return models


def same_stiffness(scene: Scene, other: Scene) -> bool:
    """Whether two scenes are joints with the same K."""
    if not (isinstance(scene, JointScene) and isinstance(other, JointScene)):
        return False
    keys = [Springs.of(one).key(one.assembly_key) for one in (scene, other)]
    return keys[0] == keys[1]


def adopts_model(scene: Scene, other: Scene) -> bool:
    """Give a scene the model of another one if both have the same K; returns whether they have."""
    if same := same_stiffness(scene, other):
        object.__setattr__(scene, "model", replace(cast(Any, model_of(other)), scene=scene))
    return same


def prepared(scene: Scene, reporter: Reporter = SILENT, form: Form = "dual") -> Prepared:
    """K and A of a scene, condensed from the cache or now, or as they are for the sparse form.

    Factors and Q are made when first needed. Raises InputError if a part can move freely, if a user's
    matrices are invalid, or in a dense form if contacts depend on one another.
    """
    model = model_of(scene)
    return model.sparse() if form == "sparse" else model.dense(reporter)


def load_case(scene: Scene, form: Form = "dual", effects: Iterable[Effect] | None = None) -> LoadCase:
    """f, an entry per unknown of K, and g: the sum of the terms of a joint's effects, or the user's own.

    effects : those of the joint that count; by default all.
    """
    return model_of(scene).load_case(form == "sparse", effects)


@dataclass(frozen=True)
class GivenModel:
    """The model of a scene that has its own K, A, f and g, so that there is nothing to condense."""

    scene: MatricesScene | ManufacturedScene

    def sparse(self) -> SparsePrepared:
        """K with sparse blocks. Raises InputError also if K is dense."""
        start, scene = time.perf_counter(), self.scene
        assembly = self._read(sparse=True)[0]
        K = assembly.K.as_sparse(assembly.nodes)
        for block in K.blocks:
            share = block.matrix.nnz / block.size**2
            if block.size > SMALL and share > DENSEST and not assembly.dependent:
                allowed = f"at most {DENSEST:.0%} of a block's entries; K is dense: use --form dual or primal"
                raise InputError.one(scene.source_of("K"), "nonzero entries of K", f"{share:.0%}", allowed)
        seconds = time.perf_counter() - start
        refuses_singular = isinstance(scene, MatricesScene) or scene.refuses_singular
        return SparsePrepared(replace(assembly, K=K), seconds, scene.source_of, refuses_singular)

    def dense(self, reporter: Reporter = SILENT) -> DensePrepared:
        """K with dense blocks. Raises InputError if contacts depend on one another."""
        assembly, _, seconds, key = self._read(sparse=False)
        refuse_dependent(assembly.A, assembly.K.units, self.scene.source_of("A"))
        K = assembly.K.as_dense()
        if K is not assembly.K:
            assembly = replace(assembly, K=K, parts=tuple(f"part {k + 1}" for k in range(len(K.blocks))))
        return DensePrepared(assembly, key, {"condensation": seconds}, self.scene.source_of, reporter)

    def load_case(self, sparse: bool, effects: Iterable[Effect] | None = None) -> LoadCase:
        """The scene's f and g; it has no effects."""
        return self._read(sparse)[1]

    @property
    def built(self) -> bool:
        """Whether the dense factors and Q are in the cache."""
        return self.dense().built

    @property
    def stored_sparse(self) -> Assembly | None:
        """The assembly with sparse blocks, if a large K is given so, and is not full of entries."""
        from problems.input import user_matrices  # slow to import

        if isinstance(scene := self.scene, ManufacturedScene):
            large_sparse = scene.sparse and sum(scene.block_sizes) > user_matrices.SMALL
        else:
            large_sparse = user_matrices.holds_sparse(dict(scene.files))
        if not large_sparse:
            return None
        assembly = self._read(sparse=True)[0]
        few = assembly.K.matrix.nnz <= DENSEST * assembly.n**2
        return assembly if few or assembly.dependent else None

    @property
    def dependent(self) -> bool:
        """Whether contacts depend on one another."""
        return (self.stored_sparse or self._read(sparse=False)[0]).dependent

    def _read(self, sparse: bool) -> tuple[Assembly, LoadCase, float, str]:
        """The assembly and its load case, the seconds that reading them took, and their key."""
        scene = self.scene
        if isinstance(scene, ManufacturedScene):
            return scene.made.assembly, scene.made.load, 0.0, scene.assembly_key
        from problems.input.user_matrices import stored_matrices  # only for own matrices

        return stored_matrices(dict(scene.files), scene.assembly_key, sparse)
