"""What takes a scene with stages: its last stage is what is measured, exported and judged."""

from pathlib import Path

import pytest
from small_joints import two_parts

from harness.scene.solution import solve
from harness.verification.reference_problem import last_stage, opened
from problems.forms import Form
from problems.scene_files import read_scene
from rivetbench import export, judge, validate

EFFECTS = """
title = "Riveted"
[[effect]]
kind = "initial_gap"
mean = 0.3
[[effect]]
kind = "clamps"
name = "clamps"
clamping_force = 60.0
points = [[30.0, 20.0], [70.0, 20.0]]
[[effect]]
kind = "installed_fasteners"
name = "rivets"
stiffness = 2e3
points = [[20.0, 5.0], [50.0, 5.0], [80.0, 5.0]]
[[stage]]
name = "clamp"
on = ["clamps"]
[[stage]]
name = "rivet"
on = ["rivets"]
[[stage]]
name = "release"
off = ["clamps"]
"""


@pytest.fixture
def staged(tmp_path: Path) -> Path:
    path = tmp_path / "staged.toml"
    path.write_text(EFFECTS + two_parts(nodes=(9, 5)))
    return path


@pytest.mark.parametrize("form", ["dual", "sparse"])
def test_the_problem_is_the_last_stage(staged: Path, form: Form) -> None:
    scene, answer = read_scene(str(staged)), solve(str(staged), form=form)
    problem = opened(scene, form)
    assert problem.scene.key == scene.key
    assert abs(problem.load.f - answer.problem.load.f).max() <= 1e-8
    x = problem.prepared.assembly.at_junction(problem.reference.x)
    assert abs(x - answer.x).max() <= 1e-10
    assert judge(scene, answer.unknowns, form=form).verdict == "within"
    assert last_stage(scene) == last_stage(read_scene(str(staged)))


def test_export_is_the_last_stage(staged: Path, tmp_path: Path) -> None:
    answer = solve(str(staged))
    files = export(staged, tmp_path / "last.npz", format="npz")
    again = solve(str(files))
    assert abs(again.x - answer.x).max() <= 1e-10
    assert validate(staged) is not None
