"""Series of scenes with stages: each case against the scene that has its gap."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import harness, wrong_usage
from small_joints import STAGED, scene_at, with_gap
from strip_scene import strip_with

from harness.results import series_file
from harness.scene.solution import solve
from harness.series.load_case_source import GapCases
from harness.series.session import Job
from harness.series.staged import StagedSession
from problems.build import load_case
from problems.forms import Form
from problems.model.stage_answers import last_scene

COUNT = 3


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "scene.toml").write_text(STAGED, "utf-8")
    return tmp_path / "scene.toml"


@pytest.mark.usefixtures("blank_pictures")
@pytest.mark.parametrize(("form", "solver"), [("dual", "newton"), ("sparse", "newton"), ("primal", "piqp")])
def test_each_case_goes_through_all_stages(scene: Path, tmp_path: Path, form: Form, solver: str) -> None:
    command = "series", scene, "--cases", COUNT, "--form", form, "--solver", solver, "--out", tmp_path / "s"
    assert harness(*command, "--limit", 1e-6, "--tolerance", 1e-10).exit_code == 0
    read = scene_at(scene)
    without = tuple(effect for effect in read.effects if effect.kind != "shims")
    shims = load_case(replace(read, stages=())).g - load_case(replace(read, effects=without, stages=())).g
    cases = GapCases(count=COUNT).of(last_scene(read), form)
    rows = sorted(series_file.rows(tmp_path / "s"), key=lambda row: row["case"])
    assert len(rows) == COUNT
    for row in rows:
        exact = solve(with_gap(read, cases.load(row["case"]).g - shims))
        assert row["max_gap_mm"] == pytest.approx(exact.gap.max(), abs=1e-8)
        assert row["mean_gap_mm"] == pytest.approx(exact.gap.mean(), abs=1e-8)
        largest = {stage.name: pytest.approx(stage.gap.max(), abs=1e-8) for stage in exact.stages}
        assert row["stages_max_gap_mm"] == largest
    assert len({row["max_gap_mm"] for row in rows}) == COUNT


def test_a_shim_of_a_later_stage_leaves_the_measured_gap_of_the_first(scene: Path, tmp_path: Path) -> None:
    """Each stage of a row of a table is that of the scene with a scan of its gaps."""
    read = scene_at(scene)
    row = np.random.default_rng(2).uniform(0.02, 0.08, read.joint.size[1])
    np.save(tmp_path / "gaps.npy", row[None])
    cases = GapCases(gaps=tmp_path / "gaps.npy").of(read, "dual")
    job = Job(scene=read, cases=cases, form="dual", check=0, threads=1)
    ((result,),) = StagedSession(job).solve([0])
    exact = solve(with_gap(read, row))
    largest = {stage.name: pytest.approx(stage.gap.max(), abs=1e-8) for stage in exact.stages}
    assert result.row["stages_max_gap_mm"] == largest
    np.testing.assert_allclose(result.gap, exact.gap, rtol=0, atol=1e-6)


def test_what_does_not_go_through_stages(scene: Path, tmp_path: Path) -> None:
    out = "--out", tmp_path / "s"
    assert "has stages" in wrong_usage("series", scene, "--sweep", "initial_gap.mean=0.1,0.2", *out)
    named = (
        ('kind = "initial_gap"', 'kind = "initial_gap"\nname = "gap"'),
        ('on = ["shim"', 'on = ["gap", "shim"'),
    )
    scene.write_text(strip_with(*named, text=STAGED), "utf-8")
    assert "a series replaces it" in wrong_usage("series", scene, "--cases", 2, *out)
