"""The model of a scene is made once, and its file read once, whatever is asked of it."""

from pathlib import Path
from typing import Any

import pytest
from commands import harness
from joints import make_joint, make_scene, two_parts

from problems import scene as reading
from problems.build import load_case, model_of, prepared
from problems.effects.installed_fasteners import InstalledFasteners
from problems.effects.self_weight import SelfWeight
from problems.model.joint_model import JointModel

TEXT = (
    two_parts()
    + """
[[effect]]
kind = "pressure"
part = "a"
value = 1e-3
[[effect]]
kind = "initial_gap"
mean = 0.1
[[effect]]
kind = "self_weight"
part = "b"
"""
)


@pytest.mark.parametrize("form", ["dual", "primal", "sparse"])
def test_one_solve_makes_one_model_and_reads_its_scene_once(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, read = [], []
    of, toml = JointModel.of.__func__, reading.read_toml  # type: ignore[attr-defined]

    def counted(cls: Any, scene: Any) -> Any:
        made.append(scene)
        return of(cls, scene)

    def counted_read(path: Path) -> Any:
        read.append(path)
        return toml(path)

    monkeypatch.setattr(JointModel, "of", classmethod(counted))
    monkeypatch.setattr(reading, "read_toml", counted_read)
    path = tmp_path / "scene.toml"
    path.write_text(TEXT)
    done = harness("solve", path, "--form", form, "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert (len(made), read) == (1, [path])


def test_load_cases_of_some_effects_add_up_to_that_of_all() -> None:
    part = {"north": {"length": 90.0, "elements": 2}, "clamped": ["north"]}
    weight = SelfWeight(kind="self_weight", part="a")
    tie = InstalledFasteners(kind="installed_fasteners", points=((200.0, 40.0),), approach=0.5)
    scene = make_scene(make_joint(part, part | {"name": "b"}), weight, tie)
    for form in ("dual", "sparse"):
        whole = load_case(scene, form)
        alone = [load_case(scene, form, [effect]) for effect in (weight, tie)]
        assert abs(whole.f).max() > 0
        assert abs(whole.f - sum(each.f for each in alone)).max() <= 1e-12 * abs(whole.f).max()
    assert model_of(scene) is model_of(scene)
    assert prepared(scene).assembly.parts == prepared(scene, form="sparse").assembly.parts == ("a + b",)
