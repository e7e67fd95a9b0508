"""Commands on a scene of superelements: init, validate, solve, two scenes, series, run, export."""

import csv
import json
import runpy
import tomllib
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from commands import harness, succeeds
from superelements import flat, stiffnesses, two_plates, write_part

from harness import solve
from harness.scene.answer_record import arrays_of, recorded
from problems.scene_files import read_scene


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The starter of two parts, one with three unknowns per node, one scattered; its fasteners placed."""
    folder, joint = tmp_path_factory.mktemp("parts"), two_plates()
    K, _ = stiffnesses(joint)
    local = np.diag(np.tile([1e3, 2e3, 0.0], 45))
    local[2::3, 2::3] = K
    write_part(folder, "wing", local, flat(joint.nodes))
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 400, 11), np.linspace(0, 120, 6)))
    inside = (x > 0) & (x < 400) & (y > 0) & (y < 120)
    moved = np.random.default_rng(8).uniform(-6, 6, (66, 2)) * inside[:, None]
    nodes = flat(np.column_stack([x, y]) + moved)
    distance = np.linalg.norm(nodes[:, None] - nodes, axis=2)
    springs = 30 * np.eye(66) + 200 * np.exp(-((distance / 60) ** 2))
    write_part(folder, "frame", springs, nodes)
    succeeds("init", "--superelements", folder / "wing.npz", folder / "frame.npz", folder / "scene.toml")
    text = (folder / "scene.toml").read_text().replace("dofs = [3]", 'dofs = [1, 2, 3]\nrows = "table"', 1)
    (folder / "edited.toml").write_text(
        text.replace("points = [[0.0, 0.0]]", "points = [[100.0, 60.0], [290.0, 33.0]]")
    )
    return folder


@pytest.fixture(scope="module")
def answered(folder: Path) -> tuple[Path, str]:
    """The directory of the answer, with its pictures, and what `solve` says."""
    told = succeeds("solve", folder / "edited.toml", "--out", folder / "answer", "--allow-gap", 5.0)
    return folder / "answer", told


def test_the_starter_needs_one_edit(folder: Path) -> None:
    text = (folder / "scene.toml").read_text()
    assert text.count("EDIT") == 1
    assert 'superelement = "wing.npz"\nnodes = "wing.csv"' in text
    assert f"solve {folder / 'scene.toml'}" in text
    assert read_scene(str(folder / "edited.toml")).joint.names == ("wing", "frame")
    assert harness("init", "--superelements", folder / "wing.npz", folder / "scene.toml").exit_code == 2
    assert harness("init", "--superelements", folder / "new.toml").exit_code == 2


@pytest.mark.parametrize("name", ["PROFILE", "$FILE", 'PARTS "A"', "TITLE\\n", "a\nb = 1", "\x7f\U0001f600"])
def test_a_part_may_have_any_name(name: str, tmp_path: Path) -> None:
    scene = tmp_path / "my scene.toml"
    succeeds("init", "--superelements", tmp_path / f"{name}.npz", scene)
    text = scene.read_text("utf-8")
    assert f"solve '{scene}' --allow-gap" in text
    written = tomllib.loads(text)
    (part,) = written["joint"]["part"]
    assert part["name"] == written["title"] == name
    assert (part["superelement"], part["nodes"]) == (f"{name}.npz", f"{name}.csv")
    assert harness("init", tmp_path / "two\nlines.toml").exit_code == 2


def test_the_starter_names_files_through_links(tmp_path: Path) -> None:
    (tmp_path / "far" / "away").mkdir(parents=True)
    (tmp_path / "here").symlink_to(tmp_path / "far" / "away")
    (tmp_path / "wing.npz").touch()
    succeeds("init", "--superelements", tmp_path / "wing.npz", tmp_path / "here/scene.toml")
    (part,) = tomllib.loads((tmp_path / "here/scene.toml").read_text("utf-8"))["joint"]["part"]
    assert (part["superelement"], part["nodes"]) == ("../../wing.npz", "../../wing.csv")
    assert (tmp_path / "here" / part["superelement"]).is_file()


def test_parts_whose_files_are_called_alike_have_the_names_of_their_folders(tmp_path: Path) -> None:
    files = [tmp_path / name / "K.mtx" for name in ("wing", "frame")]
    succeeds("init", "--superelements", *files, tmp_path / "scene.toml")
    written = tomllib.loads((tmp_path / "scene.toml").read_text())
    assert [part["name"] for part in written["joint"]["part"]] == ["wing", "frame"]
    assert written["title"] == "wing on frame"


def test_validate_says_what_there_is(folder: Path) -> None:
    told = succeeds("validate", folder / "edited.toml")
    for said in (
        "135 unknowns, 45 contact nodes",
        "45 nodes of wing",
        "n = 201, m = 45",
        "Points are given along",
        "First rows of K of wing: node 1 x, node 1 y, node 1 z, node 2 x",
    ):
        assert said in told


def test_solve_writes_pictures_tables_and_forces(
    folder: Path, answered: tuple[Path, str], tmp_path: Path
) -> None:
    out, said = answered
    assert "Mesh error: not known here" in said
    refined = harness("solve", folder / "edited.toml", "--refine", "--out", tmp_path / "refined")
    assert refined.exit_code == 2
    record = json.loads((out / "solution.json").read_text())
    assert [force["force_N"] for force in record["fasteners"]] == [300.0, 300.0]
    assert record["marks"] == {"fasteners": [[100.0, 60.0], [290.0, 33.0]]}
    assert "digits" in record["digits"]
    with np.load(out / "solution.npz") as saved:
        assert len(saved["unknowns"]) == 201
        assert len(saved["x"]) == len(saved["nodes"]) == 45 + 66
        np.testing.assert_array_equal(saved["x"][:45], saved["unknowns"][2:135:3])
    for name in ("gap.png", "forces.png", "displacement.png", "index.html"):
        assert (out / name).stat().st_size > 5000
    with (out / "nodes.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert [line["node"] for line in lines[:45]] == [str(k) for k in range(1, 46)]
    assert len(lines) == 111
    meshio = pytest.importorskip("meshio")
    mesh = meshio.read(out / "solution.vtu")
    pushed = mesh.point_data["contact_force_N"]
    assert pushed[:45].sum() == pytest.approx(-pushed[45:].sum())


@pytest.mark.usefixtures("without_pictures")
def test_two_plans_a_series_and_a_run(folder: Path, tmp_path: Path) -> None:
    text = (folder / "edited.toml").read_text()
    (folder / "more.toml").write_text(text.replace("preload = 300.0", "preload = 600.0"))
    succeeds("solve", folder / "edited.toml", folder / "more.toml", "--out", tmp_path / "both")
    assert (tmp_path / "both" / "comparison.md").is_file()
    (scan := folder / "scan.csv").write_text("x,y,gap\n10,10,0.2\n")
    options = ("--sd", 0.05, "--correlation-length", 80.0, "--cases", 6, "--around", scan)
    succeeds("series", folder / "edited.toml", *options, "--out", tmp_path / "series")
    succeeds("run", "--scene", folder / "edited.toml", "--solver", "gi", "--out", tmp_path / "run")
    assert (tmp_path / "run" / "report" / "report.md").is_file()


@pytest.mark.usefixtures("without_pictures")
def test_what_is_exported_is_the_same_problem(
    folder: Path, answered: tuple[Path, str], tmp_path: Path
) -> None:
    succeeds("export", folder / "edited.toml", "--format", "npz", "--out", tmp_path / "out.npz")
    succeeds("solve", tmp_path / "out.npz", "--out", tmp_path / "again")
    with (
        np.load(tmp_path / "again" / "solution.npz") as again,
        np.load(answered[0] / "solution.npz") as first,
    ):
        np.testing.assert_allclose(again["gap_after"], first["gap_after"], atol=1e-9)
        np.testing.assert_allclose(again["x"], first["unknowns"], atol=1e-9)


@pytest.mark.usefixtures("without_pictures")
def test_the_example_is_solved_and_made_again(tmp_path: Path) -> None:
    example = Path(__file__).parents[2] / "examples" / "own-parts"
    succeeds("solve", example / "joint.toml", "--out", tmp_path / "out")
    made = runpy.run_path(str(example / "make_parts.py"))
    for name in ("wing", "frame"):
        assert (example / f"{name}.npz").stat().st_size < 300_000
    K, nodes = made["plate"](np.linspace(0, 600, 17), np.linspace(0, 300, 11), 2.5, 300.0, 0.0)
    with np.load(example / "wing.npz") as stored:
        np.testing.assert_allclose(K, stored["K"], atol=1e-9 * abs(K).max())
    assert len(nodes) == len((example / "wing.csv").read_text().splitlines()) - 1


def write_tilted(folder: Path, normal: tuple[float, float], dofs: list[int]) -> Path:
    """A part of 3 x 3 nodes whose normals have these x and y, pressed against a tool."""
    x, y = (each.ravel() for each in np.meshgrid(np.arange(0.0, 41, 20), np.arange(0.0, 41, 20)))
    tilt = np.array([*normal, np.sqrt(1 - np.dot(normal, normal))])
    K = np.eye(9 * len(dofs)) + 0.1
    write_part(folder, "a", K, flat(np.column_stack([x, y])), np.tile(tilt, (9, 1)), dofs=dofs)
    rows = 'rows = "table"\n' if len(dofs) > 1 else ""
    part = f'[[joint.part]]\nname = "a"\nsuperelement = "a.npz"\nnodes = "a.csv"\ndofs = {dofs}\n{rows}'
    effects = '[[effect]]\nkind = "initial_gap"\nmean = 0.05\n[[effect]]\nkind = "pressure"\n'
    text = f'[joint]\ncontacts = [["a", "tool"]]\n{part}{effects}part = "a"\nvalue = 1e-3\n'
    (folder / "scene.toml").write_text(text)
    return folder / "scene.toml"


def test_the_bound_is_that_of_the_displacements_shown(tmp_path: Path) -> None:
    """Along inclined normals they are sums of three unknowns, rounded."""
    answer = solve(str(write_tilted(tmp_path, (0.1, 0.05), [1, 2, 3])))
    bound, away = Fraction(answer.problem.reference.bound_mm), list[Fraction]()
    shown = answer.problem.scene.joint.shown  # type: ignore[attr-defined]
    for row, value in zip(shown.toarray(), arrays_of(answer)["x"], strict=True):
        terms = [(Fraction(d), Fraction(answer.x[k])) for k, d in enumerate(row) if d]
        off = abs(Fraction(value) - sum(d * x for d, x in terms))
        away.append(off + bound * sum(abs(d) for d, _ in terms))
    assert bound < max(away) <= recorded(answer, set(), None)["error_bound_mm"] <= 50 * max(away)


@pytest.mark.usefixtures("without_pictures")
def test_an_answer_along_inclined_normals_is_judged_by_its_unknowns(tmp_path: Path) -> None:
    """One unknown per node, which is not the displacement that nodes.csv has."""
    scene, out = write_tilted(tmp_path, (0.04, 0.0), [3]), tmp_path / "out"
    succeeds("solve", scene, "--out", out)
    succeeds("judge", out / "solution.npz", scene)
    done = harness("judge", out / "nodes.csv", scene)
    assert (done.exit_code, "`unknowns` of solution.npz" in " ".join(done.stderr.split())) == (2, True)
    succeeds("judge", out / "contacts.csv", scene)
