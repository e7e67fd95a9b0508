"""`solve` and `validate`: the answer, its files, and what was not computed."""

import json
import subprocess
import sys
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from commands import harness, succeeds, wrong_usage
from matplotlib.image import imread
from small_joints import forbid_building, two_parts
from small_problems import solve_by_nnls
from suite_runs import said_by

from harness.results.records import read_arrays
from harness.scene.solution import Solution, solve
from harness.scene.solve import solve_into
from problems.build import load_case, model_of, prepared
from problems.scene_files import read_scene
from report.writers.answer_report import grid_with_fields, write_vtu

ROOT = Path(__file__).parents[2]
SCENE = """
title = "Two panels on a tool"
[[effect]]
kind = "rigid_tool"
part = "b"
distance = 0.4
[[effect]]
kind = "initial_gap"
mean = 0.3
between = ["a", "b"]
random = { sd = 0.05, correlation_length = 60.0, seed = 2 }
[[effect]]
kind = "fasteners"
preload = PRELOAD
points = [[60.0, 20.0], [140.0, 40.0]]
[[effect]]
kind = "ribs"
part = "a"
lines = [40.0]
I = 500.0
[[effect]]
kind = "installed_fasteners"
points = [[100.0, 60.0]]
approach = 0.3
[[effect]]
kind = "self_weight"
part = "b"
""" + two_parts(200.0, 80.0, (11, 5), "south")
APART = """
[[effect]]
kind = "initial_gap"
mean = 5.0
[[effect]]
kind = "pressure"
part = "a"
value = 1e-3
""" + SCENE[SCENE.index("[joint]") :]


pytestmark = pytest.mark.usefixtures("without_pictures")  # but of `solved`


def run(folder: Path, text: str = SCENE, solver: str | None = None, preload: float = 80.0) -> dict[str, Any]:
    """Solve, and return what solution.json says with the exit code and the terminal's text."""
    path = folder / "scene.toml"
    path.write_text(text.replace("PRELOAD", str(preload)))
    code, shown = said_by(partial(solve_into, str(path), solver, 1e-10 if solver else 1e-9, folder / "out"))
    record = json.loads((folder / "out" / "solution.json").read_text())
    return record | {"code": code, "shown": shown}


def arrays(folder: Path) -> dict[str, Any]:
    return read_arrays(folder / "out" / "solution.npz")


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """What `run` gives of SCENE, and its folder; nothing of it was in the cache."""
    folder = tmp_path_factory.mktemp("solved")
    return run(folder, SCENE.replace("I = 500.0", "I = 501.0")), folder


def test_the_answer_is_that_of_another_method(solved: tuple[dict[str, Any], Path]) -> None:
    record, folder = solved
    scene = read_scene(str(folder / "scene.toml"))
    data = prepared(scene)
    x, lam = solve_by_nnls(data, load_case(scene))
    answer = arrays(folder)
    assert record["code"] == 0
    assert record["qp"]
    assert 0 < record["error_bound_mm"] < 1e-11
    np.testing.assert_allclose(answer["x"], x, atol=1e-9)
    np.testing.assert_allclose(answer["lam"], lam, atol=1e-4)
    assert 5 < (lam > 0).sum() < 100
    np.testing.assert_allclose(answer["gap_after"], answer["gap_before"] - data.assembly.A.T @ x, atol=1e-9)


def test_a_named_solver_is_judged(tmp_path: Path) -> None:
    record = run(tmp_path, solver="piqp")
    assert record["code"] == 0
    assert record["verdict"] == "within"
    assert 0 <= record["judged_error_mm"] <= 1e-7
    assert record["method"].startswith("piqp, dual form")
    assert "judged" in (tmp_path / "out" / "answer.md").read_text()


def test_an_answer_outside_the_limit_fails(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.replace("PRELOAD", "80"))
    code, shown = said_by(partial(solve_into, str(tmp_path / "scene.toml"), "piqp", 1e-1, tmp_path / "out"))
    assert code == 1
    assert "outside" in shown


def test_parts_that_do_not_meet_are_a_linear_solve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("solvers.libraries.piqp.Piqp.convert", lambda *_: pytest.fail("a QP solver was run"))
    monkeypatch.setattr("harness.solving.solver_session.forces_of", lambda *_: pytest.fail("a QP was solved"))
    record = run(tmp_path, APART, solver="piqp")
    assert not record["qp"]
    assert record["code"] == 0
    answer = arrays(tmp_path)
    assert not answer["lam"].any()
    data = prepared(read_scene(str(tmp_path / "scene.toml")))
    f = load_case(read_scene(str(tmp_path / "scene.toml"))).f
    for K, rows in zip(data.assembly.K.matrices, data.assembly.K.slices, strict=True):
        np.testing.assert_allclose(answer["x"][rows], np.linalg.solve(K, f[rows]), atol=1e-12)
    assert record["closest_mm"] == pytest.approx(answer["gap_after"].min(), rel=1e-9)
    assert any("not called for" in line and "piqp was not run" in line for line in record["skipped"])
    assert "No quadratic program was needed" in (tmp_path / "out" / "answer.md").read_text()
    assert "linear solve" in record["shown"]


def test_files_hold_the_answer(solved: tuple[dict[str, Any], Path]) -> None:
    out, answer = solved[1] / "out", arrays(solved[1])
    nodes, contacts = pd.read_csv(out / "nodes.csv"), pd.read_csv(out / "contacts.csv")
    # pandas before 3.1 reads the last digits of a text inexactly.
    same = partial(np.testing.assert_allclose, rtol=1e-12, atol=1e-15)
    assert list(nodes) == ["part", "x_mm", "y_mm", "displacement_mm"]
    assert nodes["part"].value_counts().to_dict() == {"a": 55, "b": 55}
    same(nodes["displacement_mm"], answer["x"])
    same(nodes[["x_mm", "y_mm"]], answer["nodes"])
    assert contacts["contact"].value_counts().to_dict() == {"a – b": 55, "b – tool": 55}
    same(contacts["gap_after_mm"], answer["gap_after"])
    same(contacts["force_N"], answer["lam"])
    text = (out / "answer.md").read_text()
    for name in ("gap", "forces", "displacement"):
        assert f"]({name}.png)" in text
        height, width, *_ = imread(out / f"{name}.png").shape
        assert min(height, width) > 100  # at 40 dpi
    assert len(text.splitlines()) < 90


def test_a_change_of_loads_alone_reuses_the_assembly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(tmp_path)
    first = arrays(tmp_path)
    forbid_building(monkeypatch)
    record = run(tmp_path, preload=160.0)
    (line,) = record["skipped"]
    assert "came from the cache" in line
    assert line in (tmp_path / "out" / "answer.md").read_text()
    assert abs(arrays(tmp_path)["x"] - first["x"]).max() > 1e-4


def test_only_what_is_called_for_is_imported(solved: tuple[dict[str, Any], Path], tmp_path: Path) -> None:
    """Through the whole command, pictures included. The page's map is in the cache, from `solved`."""
    (tmp_path / "scene.toml").write_text(APART)
    code = "import sys, report.figures.style as style\nfrom harness.cli.app import main\nstyle.DPI = 40\n"
    code += "try:\n    main()\nfinally:\n    print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code, "solve", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "out")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    modules = set(done.stdout.splitlines()[-1].split())
    assert {m for m in modules if m.startswith("problems.effects.")} == {
        "problems.effects.initial_gap",
        "problems.effects.pressure",
    }
    assert not modules & {
        "problems.model.stress",
        "solvers.methods.ipm",
        "solvers.methods.gi",
        "solvers.registry",
        "bokeh",
    }


def test_own_matrices_without_coordinates(tmp_path: Path) -> None:
    K = np.array([[3.0, 1.0, 0.0], [1.0, 4.0, 0.0], [0.0, 0.0, 2.0]])
    A = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    np.savez(tmp_path / "mine.npz", K=K, A=A, f=np.array([5.0, 1.0, 0.0]), g=np.array([0.1, 9.0]))
    assert said_by(partial(solve_into, str(tmp_path / "mine.npz"), None, 1e-9, tmp_path / "out"))[0] == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        *("answer.md", "answer.pdf", "contacts.csv", "index.html", "nodes.csv"),
        *("solution.json", "solution.npz"),
    }
    said = harness("validate", tmp_path / "mine.npz").output
    assert "n = 3, m = 2, blocks of 3" in said
    assert "seem to have 16 digits" in said


def test_a_vtu_file_reads_back(solved: tuple[dict[str, Any], Path], tmp_path: Path) -> None:
    """By meshio, which wrote it: the grid, and each field at its node."""
    import meshio

    record, answer = solved[0], arrays(solved[1])
    assert write_vtu(tmp_path / "a.vtu", record, answer) == "a.vtu"
    mesh = meshio.read(tmp_path / "a.vtu")
    np.testing.assert_array_equal(mesh.points, np.column_stack([answer["nodes"], np.zeros(110)]))
    ((quads,),) = ([block.data for block in mesh.cells if block.type == "quad"],)
    corners = mesh.points[quads]
    d1, d2 = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    areas = (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]) / 2  # all turn the same way
    np.testing.assert_allclose(areas, [20.0 * 20.0] * 80)
    names = ["displacement_mm", "part", "contact_force_N", "gap_before_mm", "gap_after_mm"]
    assert list(mesh.point_data) == names
    moved, part, force, gap_before, gap_after = (mesh.point_data[name] for name in names)
    np.testing.assert_array_equal(moved, np.column_stack([np.zeros((110, 2)), answer["x"]]))
    np.testing.assert_array_equal(part, np.repeat([0.0, 1.0], 55))
    # Part a meets b alone, part b meets a and the tool: the contacts of the two stand at the same nodes.
    between, on_tool = np.split(answer["lam"], 2)
    np.testing.assert_array_equal(force, np.concatenate([between, on_tool - between]))
    for field, name in ((gap_before, "gap_before"), (gap_after, "gap_after")):
        gap, to_tool = np.split(answer[name], 2)
        np.testing.assert_array_equal(field, np.concatenate([gap, np.minimum(gap, to_tool)]))


@pytest.mark.parametrize(("lam", "forces"), [(1.25, [2.5, -3.75, 0.0]), (np.nan, [np.nan, np.nan, 0.0])])
def test_the_forces_on_the_nodes_are_A_lambda(lam: float, forces: list[float]) -> None:
    """A = (2, −3, 0): entries other than ±1 count, and unknown forces are no zeros."""
    record = {"n": 3, "m": 1, "parts": [{"start": 0, "stop": 3}]}
    data = {"A_data": [2.0, -3.0], "A_indices": [0, 1], "A_indptr": [0, 2], "lam": [lam]}
    data |= {"nodes": np.zeros((3, 2)), "x": np.zeros(3), "gap_before": [1.0], "gap_after": [0.0]}
    given = {name: np.array(values) for name, values in data.items()}
    np.testing.assert_array_equal(grid_with_fields(record, given)[2]["contact_force_N"], forces)


def test_without_meshio_the_page_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "meshio", None)
    run(tmp_path)
    assert "meshio is not installed" in (tmp_path / "out" / "answer.md").read_text()


def test_validate_says_what_will_be_built(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.replace("PRELOAD", "80").replace("I = 500.0", "I = 777.0"))
    first = harness("validate", path)
    assert first.exit_code == 0
    for said in ("n = 110", "m = 110", "contact b – tool", "Dense forms", "self_weight"):
        assert said in first.output
    assert not model_of(read_scene(str(path))).built
    _ = prepared(read_scene(str(path))).Q
    assert "is in the cache" in harness("validate", path).output


def own_scene(path: Path, contacts: int) -> Path:
    np.savez(path, K=np.eye(2), A=np.eye(2, contacts), f=np.full(2, 2.0), g=np.ones(contacts))
    return path


def test_nothing_of_an_older_answer_remains_and_what_is_not_ours_does(tmp_path: Path) -> None:
    out = tmp_path / "out"
    succeeds("solve", own_scene(tmp_path / "one.npz", 1), "--out", out)
    assert (out / "contacts.csv").exists()
    (out / "mine.txt").write_text("kept")
    succeeds("solve", own_scene(tmp_path / "none.npz", 0), "--out", out)
    assert not (out / "contacts.csv").exists()
    assert (out / "mine.txt").read_text() == "kept"
    files = json.loads((out / "solution.json").read_text())["files"]
    assert sorted([*files, "mine.txt"]) == sorted(path.name for path in out.iterdir())


def test_hashes_of_inputs_are_of_the_files_as_they_were_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (scene := tmp_path / "scene.toml").write_text(APART)
    read = sha256(scene.read_bytes()).hexdigest()

    def edited_meanwhile(*arguments: Any, **options: Any) -> Solution:
        scene.write_text("# for the next answer")
        return solve(*arguments, **options)

    monkeypatch.setattr("harness.scene.solve.solve", edited_meanwhile)
    said_by(partial(solve_into, str(scene), None, 1e-9, tmp_path / "out"))
    record = json.loads((tmp_path / "out" / "solution.json").read_text())
    assert record["inputs"] == {"scene.toml": read}


def test_a_full_disk_leaves_the_older_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    scene = own_scene(tmp_path / "one.npz", 1)
    succeeds("solve", scene, "--out", out)
    contents = {path.name: path.read_bytes() for path in out.iterdir()}

    def full(*_: object) -> None:
        raise OSError(27, "File too large")

    monkeypatch.setattr("report.writers.answer_report.write_page", full)
    assert "File too large" in wrong_usage("solve", scene, "--out", out)
    assert {path.name: path.read_bytes() for path in out.iterdir()} == contents
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.npz", "out"]
