"""The coarser model of the preconditioner: the same junction, nearly the same compliance, no softer."""

from typing import Any

import numpy as np
import pytest
import scipy.linalg as sla
from joints import make_joint, make_scene

from problems.forms.prepared import Prepared
from problems.model.effect import Effect, effect_class
from problems.model.joint_model import JointModel
from problems.model.scene import JointScene
from problems.scene import read_scene, scene_names

LONG = {
    "thickness": 3.0,
    "south": {"length": 300.0, "elements": 12},
    "north": {"length": 600.0, "elements": 24},
    "clamped": ["north", "south"],
}


def effect(kind: str, **parameters: Any) -> Effect:
    return effect_class(kind).model_validate({"kind": kind, **parameters})


def joint_with(*effects: Effect) -> JointScene:
    return make_scene(make_joint(LONG, LONG | {"name": "b"}, contacts=[("a", "b")], nodes=(8, 6)), *effects)


SCENES = {
    "plain": joint_with(),
    "ribs": joint_with(effect("ribs", part="a", lines=[320.0, 520.0], I=2e4, J=1e3)),
    "stringers": joint_with(effect("stringers", part="b", pitch=100.0, start=0.0, stop=400.0, I=2e4)),
    "pad": joint_with(effect("local_thickness", part="a", thickness=9.0, x=[100.0, 300.0], y=[200.0, 400.0])),
    "support": joint_with(effect("supports", part="a", points=[[200.0, 450.0]], stiffness_per_point=1e6)),
    "springs": joint_with(effect("installed_fasteners", points=[[100.0, 60.0], [300.0, 60.0]])),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_compliance_is_nearly_the_same_and_no_larger(name: str) -> None:
    """K' = PᵀKP, so Q' ≤ Q; half of the unknowns are gone."""
    model = JointModel.of(SCENES[name])
    coarse = model.graded()
    assert model.sparse().coarser is not None
    assert coarse.numbering.size < 0.7 * model.numbering.size
    assert coarse.tied == model.tied
    Q, near = Prepared(model.assembly()).Q, Prepared(coarse.assembly()).Q
    ratio = sla.eigh(near, Q, eigvals_only=True)
    assert 1 - 2e-3 <= ratio[0] < 1 - 1e-6
    assert ratio[-1] <= 1 + 1e-9


@pytest.mark.parametrize("scene", [*SCENES.values(), *map(read_scene, scene_names()[-9:])])
def test_the_junction_and_the_clamped_edges_are_kept(scene: Any) -> None:
    model = JointModel.of(scene)
    coarse = model.graded()
    assert coarse.junction.shape == model.junction.shape
    for given, made in zip(model.parts, coarse.parts, strict=True):
        np.testing.assert_array_equal(given.plate.y[list(given.junction)], made.plate.y[list(made.junction)])
        assert set(made.plate.y) <= set(given.plate.y)
        assert {made.plate.y[line] for line in made.clamped} == {
            given.plate.y[line] for line in given.clamped
        }
        assert (made.plate.y[[0, -1]] == given.plate.y[[0, -1]]).all()
