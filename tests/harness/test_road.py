"""Which form a scene is solved in by default."""

import pytest

from harness.planning import road
from harness.planning.road import chosen_form
from problems.full_model.joint_model import JointModel
from problems.scene import read_scene
from solvers.base import FORMS

SCENE = read_scene("11308/4300")


@pytest.fixture(autouse=True)
def _new_assembly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(JointModel, "built", False)
    monkeypatch.setattr(road, "physical_memory_mib", lambda: 1 << 20)


def test_a_method_of_this_project_takes_the_cheaper_road() -> None:
    choice = chosen_form(SCENE, FORMS, None)
    assert choice.form == "sparse"
    assert "condensing first" in choice.why


def test_a_library_stays_with_the_dual_form() -> None:
    """The estimates of the sparse form are those of newton."""
    assert chosen_form(SCENE, FORMS, None, in_house=False) == road.Choice("dual")


def test_a_library_takes_the_sparse_form_where_no_other_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    need = road.estimated(SCENE, road.FLOPS_PER_S).peak_mib
    monkeypatch.setattr(road, "physical_memory_mib", lambda: int(need) - 1)
    assert chosen_form(SCENE, FORMS, None, in_house=False).form == "sparse"
