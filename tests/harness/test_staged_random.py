"""Series with random keys of a scene with stages: each case against the scene that has its numbers."""

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import harness, wrong_usage
from riveted_strips import FORCE, STIFFNESS, approach, strips
from small_joints import POINTS, STAGED, scene_at
from strip_scene import STRIP

from harness.placement.candidates import MovableFasteners
from harness.placement.session import FastenerStudy, PlanSession, Question
from harness.results import series_file
from harness.scene.solution import solve
from harness.series import staged
from harness.series.executors import solve_on_worker
from harness.series.load_case_source import GapCases
from harness.series.session import Job, Result, SeriesOptions
from harness.series.staged import StagedSession
from harness.shimming.patches import patches_of
from harness.shimming.study import ShimStudy
from problems.forms import Form
from problems.model.fastener_forces import fastener_forces
from problems.model.scene import JointScene
from problems.model.stage_answers import last_scene
from rivetbench import run_series

RIVETS = 'name = "rivets"\npreload = 30.0\n'
LAWS = {
    "fasteners.preload": "each uniform(300, 200)",
    "fasteners.points.x": "each uniform(-1, 2)",
    "shims.thickness": "uniform(0.01, 0.02)",
    "installed_fasteners.0.preload": "each uniform(20, 20)",
    "installed_fasteners.1.approach": "each uniform(0.02, 0.02)",
    "initial_gap.mean": "normal(0.05, 0.002)",
}
OF_K = {"installed_fasteners.0.stiffness": "2 of uniform(8e4, 4e4)"}


def scene_file(folder: Path, text: str = STAGED) -> Path:
    (folder / "scene.toml").write_text(text, "utf-8")
    return folder / "scene.toml"


def random(laws: dict[str, str]) -> tuple[str, ...]:
    return tuple(f"{name}={law}" for name, law in laws.items())


def job_of(scene: JointScene, laws: dict[str, str], count: int = 2, form: Form = "dual") -> Job:
    cases = GapCases(count=count, random=random(laws)).of(scene, form)
    return Job(scene=scene, cases=cases, form=form, check=0, threads=1)


def results_of(job: Job, numbers: Any = range(2)) -> dict[int, Result]:
    return {result.row["case"]: result for some in StagedSession(job).solve(numbers) for result in some}


def with_numbers(scene: JointScene, row: dict[str, Any]) -> JointScene:
    """The scene with the numbers of a row of `LAWS`."""
    gap, tacks, shim, rivets, other = scene.effects
    places = [(x + by, y) for (x, y), by in zip(tacks.points, row["fasteners.points.x"], strict=True)]  # type: ignore[attr-defined]
    field = gap.random.model_copy(update={"seed": row["gap_seed"]})  # type: ignore[attr-defined]
    effects = (
        gap.model_copy(update={"mean": row["initial_gap.mean"], "random": field}),
        tacks.model_copy(update={"preload": tuple(row["fasteners.preload"]), "points": tuple(places)}),
        shim.model_copy(update={"thickness": row["shims.thickness"]}),
        rivets.model_copy(
            update={
                "preload": tuple(row["installed_fasteners.0.preload"]),
                "stiffness": row["installed_fasteners.0.stiffness"],
            }
        ),
        other.model_copy(update={"approach": tuple(row["installed_fasteners.1.approach"])}),
    )
    return replace(scene, effects=effects)


def test_a_case_is_the_scene_with_its_numbers(tmp_path: Path) -> None:
    """Gaps of all stages and forces after the last; rivets have a preload in the cases alone."""
    text = STAGED.replace(RIVETS, 'name = "rivets"\n').replace(
        "[[10.0, 40.0]]", "[[10.0, 40.0], [80.0, 10.0]]"
    )
    scene = scene_at(path := scene_file(tmp_path, text))
    cases, options = GapCases(count=2, random=random(LAWS | OF_K)), SeriesOptions(check=0)
    done = run_series(path, tmp_path / "out", cases, options, report=False)
    assert done.code == 0
    assert len({row["installed_fasteners.0.stiffness"] for row in done.rows}) == 2
    for row in done.rows:
        exact = solve(with_numbers(scene, row))
        largest = {stage.name: pytest.approx(stage.gap.max(), abs=2e-8) for stage in exact.stages}
        assert row["stages_max_gap_mm"] == largest
        forces = [one["force_N"] for one in fastener_forces(exact.stages[-1].scene, exact.x)]
        assert sorted(row["fastener_forces_N"]) == pytest.approx(sorted(forces), abs=1e-2)


def test_spring_back_of_a_linear_joint() -> None:
    """w₁ = cF; after the release the rivet carries k (w₁ − w₂) + R = w₂ / c."""
    c = approach(solve(strips()), 0) / FORCE
    laws = {
        "initial_gap.mean": "uniform(2, 1)",
        "fasteners.preload": "each normal(15, 2)",
        "installed_fasteners.preload": "uniform(0, 20)",
    }
    results = results_of(job_of(strips(), laws))
    for row, gap in results.values():
        assert gap is not None
        first, preload = c * sum(row["fasteners.preload"]), 2 * row["installed_fasteners.preload"]
        released = (STIFFNESS * first + preload) * c / (1 + STIFFNESS * c)
        assert row["initial_gap.mean"] - gap[2:4].mean() == pytest.approx(released, abs=1e-6)
        assert sum(row["fastener_forces_N"]) == pytest.approx(released / c, rel=1e-7)
        gaps = row["stages_max_gap_mm"]
        assert gaps["rivet"] < gaps["tack"] - 0.1 * preload * c / (1 + STIFFNESS * c)
    assert len({row["max_gap_mm"] for row, _ in results.values()}) == 2


def test_what_follows_from_what_is_locked_unproven_is_not_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = job_of(scene_at(scene_file(tmp_path)), LAWS)
    known = results_of(job)[0].row
    monkeypatch.setattr(staged, "LIMIT_MM", 0.0)
    unknown = results_of(job)[0].row
    assert [known["verdict"], unknown["verdict"]] == ["within", "cannot_be_judged"]
    assert np.isfinite([known["gap_error_mm"], known["force_error_N"]]).all()
    assert unknown["gap_error_mm"] == unknown["force_error_N"] == np.inf


def test_without_scatter_it_is_the_plain_series(tmp_path: Path) -> None:
    scene = scene_at(scene_file(tmp_path))
    still = {"fasteners.preload": "each normal(400, 1e-300)", "shims.thickness": "uniform(0.02, 1e-300)"}
    still |= {"installed_fasteners.0.preload": "normal(30, 1e-300)"}
    still |= {"installed_fasteners.1.approach": "normal(0.03, 1e-300)"}
    plain, drawn = results_of(job_of(scene, {})), results_of(job_of(scene, still))
    for k, (row, gap) in plain.items():
        for name, largest in row["stages_max_gap_mm"].items():
            assert drawn[k].row["stages_max_gap_mm"][name] == pytest.approx(largest, abs=1e-12)
        np.testing.assert_allclose(drawn[k].gap, gap, rtol=1e-6, atol=1e-12)


@pytest.mark.usefixtures("without_report")
def test_one_stage_is_the_scene_without_stages(tmp_path: Path) -> None:
    text = STRIP.replace('kind = "pressure"', 'kind = "pressure"\nname = "air"')
    text += '\n[random]\nfasteners.preload = "each normal(60, 5)"\npressure.value = "uniform(0, 2e-4)"\n'
    gaps = []
    for name, stages in (("whole", ""), ("staged", '\n[[stage]]\nname = "one"\non = ["air"]\n')):
        path = scene_file(tmp_path, text + stages)
        assert harness("series", path, "--cases", 4, "--out", tmp_path / name).exit_code == 0
        gaps.append([(row["max_gap_mm"], row["mean_gap_mm"]) for row in series_file.rows(tmp_path / name)])
    assert gaps[0] == gaps[1]


def test_cases_do_not_depend_on_order_worker_form_or_the_column_that_sets_them(tmp_path: Path) -> None:
    scene = scene_at(scene_file(tmp_path))
    whole = results_of(job := job_of(scene, LAWS))
    (tmp_path / "rivets.csv").write_text(
        "x,y,stage\n20,10,shim and rivet\n50,25,shim and rivet\n80,40,rivet\n"
    )
    head, tail = STAGED.replace(', "rivets[0:2]"', "").replace('on = ["rivets[2:3]"]', "").split(RIVETS)
    tail = tail.replace(POINTS, 'file = "rivets.csv"', 1)
    listed = job_of(scene_at(scene_file(tmp_path, head + RIVETS + tail)), LAWS, form="sparse")
    sent = replace(pickle.loads(pickle.dumps(job)), cases=job.cases.only([1, 0]))
    for some in ({one.row["case"]: one for one in solve_on_worker((sent, [1, 0]))}, results_of(listed)):
        for k, (row, gap) in some.items():
            assert row["stages_max_gap_mm"] == pytest.approx(whole[k].row["stages_max_gap_mm"], abs=1e-8)
            np.testing.assert_allclose(gap, whole[k].gap, rtol=0, atol=1e-7)
            assert all(row[name] == whole[k].row[name] for name in LAWS)


def test_what_a_stage_locks_is_not_drawn(tmp_path: Path) -> None:
    command = "series", scene_file(tmp_path), "--random", "installed_fasteners.0.approach=norm()"
    assert "locks the approach that it has reached" in wrong_usage(*command, "--out", tmp_path / "out")


def test_searches_draw_what_a_series_draws(tmp_path: Path) -> None:
    """The largest gaps of the scene's own tacks, and without further shims; the largest of the forces."""
    text = STAGED.replace("[[10.0, 40.0]]", "[[50.0, 10.0], [90.0, 10.0]]")
    scene = scene_at(scene_file(tmp_path, text))
    movable, patches = MovableFasteners.of(scene), patches_of(scene.joint, "1x1")
    job = job_of(scene, {name: law for name, law in LAWS.items() if not name.startswith("fasteners")})
    rows = [row for row, _ in results_of(job).values()]
    shims = ShimStudy(scene, last_scene(scene), job.cases, "dual", patches, (1e9, np.inf))
    tacks = FastenerStudy.of(movable, job.cases, "dual")
    for study, plan in ((tacks, movable.current), (shims, ())):
        (outcome,) = PlanSession(study).answer(Question((plan,), (0, 1)))  # type: ignore[arg-type]
        assert outcome.largest == pytest.approx([row["max_gap_mm"] for row in rows], abs=2e-7)
    forces = [max(map(abs, row["fastener_forces_N"])) for row in rows]
    assert [figures[-2] for figures in outcome.further] == pytest.approx(forces, rel=1e-5)
