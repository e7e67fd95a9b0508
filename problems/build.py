"""From a scene to its model, and to the matrices and a load case of one form of its quadratic program.

The dense forms condense the model onto the junction; the sparse form takes it as it is. Only the code that a
form needs is imported.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from problems.forms.assembly import LoadCase
from problems.forms.names import Form
from problems.forms.prepared import Prepared
from problems.forms.problem import Progress, silent
from problems.model.effect import Effect
from problems.model.scene import JointScene, ManufacturedScene, MatricesScene, Scene

if TYPE_CHECKING:
    from problems.full_model.given_model import GivenModel
    from problems.full_model.joint_model import JointModel

_last: tuple[Scene, JointModel | GivenModel] | None = None  # of several, only the last one stays in memory


def model_of(scene: Scene) -> JointModel | GivenModel:
    """The model of a scene, made once for the same scene object."""
    global _last
    if _last is None or _last[0] is not scene:
        if isinstance(scene, JointScene):
            from problems.full_model.joint_model import JointModel

            _last = scene, JointModel.of(scene)
        else:
            from problems.full_model.given_model import GivenModel

            assert isinstance(scene, MatricesScene | ManufacturedScene)
            _last = scene, GivenModel.of(scene)
    return _last[1]


def prepared(scene: Scene, progress: Progress = silent, form: Form = "dual") -> Prepared:
    """K and A of a scene, condensed from the cache or now, or as they are for the sparse form.

    Factors and Q are made when first needed. Raises InputError if a part can move freely, if a user's
    matrices are invalid, or if contacts of a rung depend on one another.
    """
    model = model_of(scene)
    return model.sparse() if form == "sparse" else model.dense(progress)


def load_case(scene: Scene, form: Form = "dual", effects: Iterable[Effect] | None = None) -> LoadCase:
    """f, an entry per unknown of K, and g: the sum of the scene's effects' terms, or the user's own.

    effects : of a joint, those that count; by default all.
    """
    return model_of(scene).load_case(form == "sparse", effects)
