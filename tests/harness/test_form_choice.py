"""Which form a scene is solved in by default."""

from typing import Any

import pytest

from harness.planning import form_choice, memory
from harness.planning.form_choice import chosen_form
from problems.errors import InputError
from problems.model.joint_model import JointModel
from problems.scene import read_scene
from solvers.base import FORMS

LARGE, SMALL = read_scene("11308/4300"), read_scene("scaling/2522")
DENSE = ("dual", "primal")


def machine_of(mib: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (form_choice, memory):
        monkeypatch.setattr(module, "physical_memory_mib", lambda: mib)


@pytest.mark.parametrize(
    ("scene", "taken", "cases", "cached", "mib", "form"),
    [
        (LARGE, FORMS, 1, False, 1 << 20, "sparse"),
        (LARGE, DENSE, 1, False, 1 << 20, "dual"),
        (LARGE, ("primal",), 1, False, 1 << 20, "primal"),
        (LARGE, ("sparse",), 1, True, 1 << 20, "sparse"),
        (LARGE, FORMS, 1, True, 1 << 20, "dual"),
        (LARGE, FORMS, form_choice.MANY, False, 1 << 20, "dual"),
        (LARGE, FORMS, form_choice.MANY, True, 1000, "sparse"),
        (SMALL, FORMS, 1, False, 1 << 20, "dual"),
    ],
)
def test_the_rule(
    scene: Any, taken: Any, cases: int, cached: bool, mib: int, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(JointModel, "built", cached)
    machine_of(mib, monkeypatch)
    choice = chosen_form(scene, taken, None, cases)
    assert choice.form == form
    assert bool(choice.why) == (form == "sparse" and taken == FORMS)


@pytest.mark.parametrize(("taken", "asked"), [(DENSE, None), (FORMS, "dual"), (DENSE, "sparse")])
def test_a_form_that_does_not_fit_or_is_not_taken_is_refused(
    taken: Any, asked: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine_of(1000, monkeypatch)
    with pytest.raises(InputError, match="--form sparse" if asked != "sparse" else "the solver takes"):
        chosen_form(LARGE, taken, asked)
