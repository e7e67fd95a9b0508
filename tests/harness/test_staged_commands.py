"""What takes a scene with stages: its last stage is what is measured, exported and judged."""

import json
import re
import shutil
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rich.console import Console
from small_joints import two_parts

from harness.measurement.worker import load_cases, scene_to_measure
from harness.planning.plan import expand
from harness.planning.suite import read_suite
from harness.scene.answer_record import arrays_of, bound_shown, recorded
from harness.scene.mesh_error import on_mesh
from harness.scene.solution import Solution, solve
from harness.scene.solve import solve_into
from harness.terminal import FAILED, GAP_EXCEEDED
from harness.verification import reference_problem
from harness.verification.judge import Reference
from harness.verification.reference import reference_of
from harness.verification.reference_problem import last_stage, open_problem
from problems.forms import Form
from problems.model.joint import Joint
from problems.model.scene import JointScene, Scene
from problems.scene_files import read_scene
from report.page.answer_page_data import stage_lines
from report.writers import sheet
from rivetbench import export, judge, stresses, validate

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


@pytest.fixture(scope="module")
def staged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("staged") / "staged.toml"
    path.write_text(EFFECTS + two_parts(nodes=(9, 5)))
    return path


@pytest.fixture(scope="module")
def answer(staged: Path) -> Solution:
    return solve(str(staged))


@pytest.mark.parametrize("form", ["dual", "sparse"])
def test_the_problem_is_the_last_stage(staged: Path, form: Form) -> None:
    scene, answer = read_scene(str(staged)), solve(str(staged), form=form)
    problem = open_problem(scene, form)
    assert problem.scene.key == scene.key
    assert abs(problem.load.f - answer.problem.load.f).max() <= 1e-8
    x = problem.prepared.assembly.at_junction(problem.reference.x)
    assert abs(x - answer.x).max() <= 1e-10
    assert judge(scene, answer.unknowns, form=form).verdict == "within"
    assert last_stage(scene) == last_stage(read_scene(str(staged)))


def test_an_answer_to_unproven_approaches_is_not_proven(
    staged: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No verdict rests on them, and they are not kept for one who asks for no limit."""
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path / "cache"))

    def known_to_a_micrometre(*arguments: Any) -> Reference:
        return replace(reference_of(*arguments), bound_mm=1e-3)

    with monkeypatch.context() as patch:
        patch.setattr(reference_problem, "reference_of", known_to_a_micrometre)
        problem = open_problem(read_scene(str(staged)))
        assert problem.reference.bound_mm == np.inf
        x, lam = problem.reference.x, problem.reference.lam
        assert problem.judged(x, lam, 1e-7).verdict == "cannot_be_judged"
        answer = solve(str(staged))
        assert [np.isfinite(stage.gap_error_mm).all() for stage in answer.stages] == [True, True, False]
        assert np.isinf(np.concatenate(stresses(answer).errors)).all()
        assert bound_shown(answer) == np.inf
    proven = open_problem(read_scene(str(staged))).reference
    assert proven.bound_mm <= 1e-9
    assert solve(str(staged)).gap_error_mm.max() <= 1e-7


def test_no_verdict_rests_on_unproven_approaches(
    staged: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the answer to the last stage is proven, at the approaches that were locked."""
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path / "cache"))

    def known_after_the_release(scene: Scene, *arguments: Any) -> Reference:
        found = reference_of(scene, *arguments)
        return found if scene.title.endswith("release") else replace(found, bound_mm=1e-3)

    monkeypatch.setattr(reference_problem, "reference_of", known_after_the_release)
    answer = solve(str(staged))
    assert answer.error_bound_mm <= 1e-9
    assert answer.judgement.verdict == "cannot_be_judged"


def test_what_is_measured_is_the_last_stage(staged: Path, tmp_path: Path) -> None:
    suite = tmp_path / "suite.toml"
    solver = '[[solver]]\nname = "newton"\n'
    suite.write_text(f'title = "One"\nscenes = ["{staged}"]\ntolerances = [1e-9]\nthreads = [1]\n{solver}')
    measurements = expand(read_suite(str(suite)))
    scene = scene_to_measure(measurements)
    (load,) = load_cases(scene, measurements)
    assert isinstance(scene, JointScene)
    assert scene.stages == ()
    np.testing.assert_array_equal(load.f, open_problem(read_scene(str(staged))).load.f)


def test_export_is_the_last_stage(staged: Path, answer: Solution, tmp_path: Path) -> None:
    files = export(staged, tmp_path / "last.npz", format="npz")
    again = solve(str(files))
    assert abs(again.x - answer.x).max() <= 1e-10
    assert validate(staged) is not None


def test_contacts_of_unknown_forces_are_not_counted(answer: Solution) -> None:
    first, *others = answer.stages
    unknown = replace(first, lam=np.full_like(first.lam, np.nan))
    record, arrays = recorded(replace(answer, stages=(unknown, *others)), set(), None), arrays_of(answer)
    assert record["stages"][0]["closed"] is None
    heads, *lines = stage_lines(record, arrays)
    closed = [str((stage.lam > 0).sum()) for stage in others]
    assert [line[heads.index("closed")] for line in lines] == ["–", *closed]
    assert lines[0][heads.index("contacts, N")] == "–"


@pytest.mark.usefixtures("blank_pictures")
def test_the_history_is_in_all_that_solve_writes(
    staged: Path, answer: Solution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The clamped parts keep the limit, the released ones do not: the exit code is that of the last stage."""
    pages: list[sheet._Page] = []

    class Kept(sheet._Page):
        def __init__(self) -> None:
            super().__init__()
            pages.append(self)

    monkeypatch.setattr(sheet, "_Page", Kept)
    told, out = StringIO(), tmp_path / "out"
    largest = [stage.gap.max() for stage in answer.stages]
    limit = (largest[1] + largest[2]) / 2
    assert largest[0] < limit < largest[2]
    console = Console(file=told, width=200)
    code = solve_into(str(staged), None, 1e-9, out, console, allow_gap_mm=limit)
    assert code == GAP_EXCEEDED
    record = json.loads((out / "solution.json").read_text())
    assert [stage["exceeded"] for stage in record["stages"]] == [False, False, True]
    assert record["scene_key"] == read_scene(str(staged)).key
    assert {one["kind"] for one in record["fasteners"]} == {"installed_fasteners"}
    with np.load(out / "solution.npz") as arrays:
        np.testing.assert_array_equal(arrays["stage_gaps"], [stage.gap for stage in answer.stages])
    page, table = (out / "answer.md").read_text(), pd.read_csv(out / "stages.csv")
    np.testing.assert_allclose(table["largest_mm"], largest, rtol=1e-12)
    np.testing.assert_allclose(table["contacts, N"], [stage.lam.sum() for stage in answer.stages], rtol=1e-9)
    assert table["verdict"].tolist() == ["PASS", "PASS", "FAIL"]
    assert table["clamps, N"].tolist()[:2] == [120.0, 120.0]
    for text in (told.getvalue(), page):
        assert "| release |" in text.replace("│", "|")
    assert "gap of clamp" in (out / "index.html").read_text()
    (page_to_file,) = pages
    assert page_to_file.at >= sheet.LOWEST
    assert "release" in [text.get_text() for text in page_to_file.figure.texts]
    assert (out / "history.png").is_file()
    assert (out / "stage-gaps.png").is_file()


def test_a_stage_that_is_not_proven_fails_the_answer(
    staged: Path, answer: Solution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, *others = answer.stages
    doubtful = replace(first, judgement=replace(first.judgement, verdict="cannot_be_judged"))
    monkeypatch.setattr("report.writers.answer_report.write", lambda folder: folder / "answer.md")
    monkeypatch.setattr(
        "harness.scene.solve.solve", lambda *_, **__: replace(answer, stages=(doubtful, *others))
    )
    assert solve_into(str(staged), None, 1e-9, tmp_path / "out", Console(file=StringIO())) == FAILED


def test_mesh_error_goes_through_the_stages(answer: Solution) -> None:
    """On its own mesh nothing moves, though the approaches are reached anew."""
    assert isinstance(answer.scene, JointScene)
    assert isinstance(answer.scene.joint, Joint)
    assert on_mesh(answer, answer.scene.joint)[0] <= 1e-9


ROOT = Path(__file__).parents[2]


def test_the_tutorial_says_what_its_scenes_give(tmp_path: Path) -> None:
    page = (ROOT / "docs/stages.md").read_text("utf-8")
    folder = shutil.copytree(ROOT / "examples/riveting", tmp_path / "riveting")
    stages = "\n".join(re.findall(r"```toml\n(.*?)```", page, re.DOTALL))
    assert stages in (folder / "with-tacks.toml").read_text("utf-8")
    answer = solve(str(folder / "with-tacks.toml"))
    rows = [re.split(r" *\| *", line)[1:-1] for line in page.splitlines() if line.count("|") == 10][2:]
    assert [stage.name for stage in answer.stages] == [row[0] for row in rows]
    for stage, (_, gap, _, closed, *forces, _) in zip(answer.stages, rows, strict=True):
        found = [stage.forces.get(name, np.nan) for name in ("clamps", "tacks", "rivets", "contacts")]
        stated = [float(text.replace("–", "nan")) for text in (gap, closed, *forces)]
        np.testing.assert_allclose([stage.gap.max(), (stage.lam > 0).sum(), *found], stated, 5e-3, 1e-6)
    apart = solve(str(folder / "without-tacks.toml")).gap.max()
    assert f"{answer.gap.max():.3f} mm with tacks, {apart:.3f} mm without" in page
    table = folder / "rivets.csv"
    line = re.findall(r"```text\n(.*?\n)```", page)[0]
    table.write_text(table.read_text() + line)
    assert f"passes, with {solve(str(folder / 'with-tacks.toml')).gap.max():.4f} mm" in page
    scene = (folder / "with-tacks.toml").read_text()
    table.write_text(table.read_text().removesuffix(line))
    (folder / "with-tacks.toml").write_text(scene.replace("preload = 100.0", "preload = 200.0"))
    assert solve(str(folder / "with-tacks.toml")).gap.max() == pytest.approx(answer.gap.max(), rel=1e-3)
