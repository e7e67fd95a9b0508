"""`solve A B`, the force in each fastener, and `init`."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from commands import harness, succeeds, wrong_usage
from matplotlib.image import imread
from small_joints import two_parts
from superelements import write_part

from harness.cli.scene import STARTER
from harness.results.records import read_arrays
from harness.scene.two_scenes import common_places
from problems.build import load_case, prepared
from problems.model.fastener_forces import fastener_forces
from problems.scene_files import read_scene
from report.page.answer_page_data import headline
from report.results.answer_record import read

FASTENERS = """
[[effect]]
kind = "fasteners"
preload = 80.0
points = [[30.0, 70.0], [150.0, 70.0]]
"""
JOINT = two_parts(160.0, 80.0, (9, 5), "south") + '[[effect]]\nkind = "initial_gap"\nmean = 0.3\n'
SPRINGS = """
[[effect]]
kind = "installed_fasteners"
points = [[80.0, 40.0], [120.0, 20.0]]
stiffness = 500.0
approach = 0.2
"""


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def gaps_of(both: Path) -> list[np.ndarray]:
    """The gaps that remain in each of two scenes."""
    return [read_arrays(both / name / "solution.npz")["gap_after"] for name in ("first", "second")]


@pytest.mark.usefixtures("without_pictures")
def test_springs_and_contacts_balance_what_the_parts_without_them_resist(tmp_path: Path) -> None:
    """K₀, A, f₀ of the scene without springs: K₀x + Aλ − f₀ is at each tied node the pull of its spring."""
    tied = write(tmp_path / "tied.toml", JOINT + FASTENERS + SPRINGS)
    bare = write(tmp_path / "bare.toml", JOINT + FASTENERS)
    succeeds("solve", tied, "--out", tmp_path / "out")
    with np.load(tmp_path / "out" / "solution.npz") as saved:
        x, lam = saved["x"], saved["lam"]
    scene = read_scene(str(bare))
    data, load = prepared(scene), load_case(scene)
    pull = data.assembly.K.multiply(x) + data.assembly.A @ lam - load.f
    forces = list(fastener_forces(read_scene(str(tied)), x))
    springs = [entry for entry in forces if entry["kind"] == "installed_fasteners"]
    assert [(entry["x"], entry["y"]) for entry in springs] == [(80.0, 40.0), (120.0, 20.0)]
    for entry in springs:
        node = round(entry["x"] / 20) + 9 * round(entry["y"] / 20)
        assert pull[node] == pytest.approx(entry["force_N"], abs=1e-8)
        assert pull[45 + node] == pytest.approx(-entry["force_N"], abs=1e-8)
        assert abs(entry["force_N"]) > 1.0
    preloads = [entry["force_N"] for entry in forces if entry["kind"] == "fasteners"]
    assert preloads == [80.0, 80.0]
    table = rows(tmp_path / "out" / "fasteners.csv")
    assert [float(row["force_N"]) for row in table] == [entry["force_N"] for entry in forces]


def test_two_scenes_are_compared_contact_by_contact(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the pictures, those of both scenes are looked at."""
    monkeypatch.setattr("report.writers.answer_report.answer_figures", lambda *_: {})
    first = write(tmp_path / "before.toml", JOINT)
    second = write(tmp_path / "after.toml", JOINT + FASTENERS + SPRINGS)
    told = succeeds("solve", first, second, "--out", tmp_path / "both", "--allow-gap", 0.29)
    assert "-0 " not in told
    gaps = gaps_of(tmp_path / "both")
    table = rows(tmp_path / "both" / "contacts.csv")
    np.testing.assert_array_equal([float(row["change_mm"]) for row in table], gaps[1] - gaps[0])
    np.testing.assert_array_equal([float(row["gap_after_first_mm"]) for row in table], gaps[0])
    (pair,) = rows(tmp_path / "both" / "pairs.csv")
    assert float(pair["largest_second_mm"]) == gaps[1].max()
    assert float(pair["most_closed_mm"]) == (gaps[0] - gaps[1]).max()
    assert float(pair["most_opened_mm"]) == max(0.0, (gaps[1] - gaps[0]).max())
    forces = rows(tmp_path / "both" / "fasteners.csv")
    assert [row["first_N"] for row in forces] == [""] * 4
    assert [float(row["second_N"]) for row in forces][:2] == [80.0, 80.0]
    page = (tmp_path / "both" / "comparison.md").read_text()
    for name in ("gaps", "difference"):
        assert f"]({name}.png)" in page
        picture = imread(tmp_path / "both" / f"{name}.png")[:, :, :3]
        for border in (picture[:3], picture[-3:], picture[:, :3], picture[:, -3:]):
            assert (border == 1.0).all()


def test_the_faults_of_both_scenes_are_told(tmp_path: Path) -> None:
    first = write(tmp_path / "first.toml", JOINT.replace("length = 160.0", "length = -160.0"))
    second = write(tmp_path / "second.toml", JOINT + '[[effect]]\nkind = "glue"\n')
    told = wrong_usage("solve", first, second, "--out", tmp_path / "both")
    assert "length = -160.0" in told
    assert ".kind = 'glue'" in told


@pytest.mark.parametrize(
    ("old", "new"),
    [("length = 160.0", "length = 170.0"), ('name = "a"', 'name = "c"')],
)
def test_scenes_with_other_contacts_are_refused(old: str, new: str, tmp_path: Path) -> None:
    first = write(tmp_path / "first.toml", JOINT)
    second = write(tmp_path / "second.toml", JOINT.replace(old, new))
    done = harness("solve", first, second, "--out", tmp_path / "both")
    assert done.exit_code == 5
    assert "second.toml: contacts" in done.stderr
    assert not (tmp_path / "both").exists()


#: A gap that rises along x and y, which a bilinear surface has exactly; nothing closes.
PLANE = """
[[effect]]
kind = "measured_gap"
points = [[0.0, 0.0, 0.1], [160.0, 0.0, 0.26], [0.0, 80.0, 0.14], [160.0, 80.0, 0.3]]
"""


@pytest.mark.parametrize("nodes", [(17, 9), (6, 4)])
@pytest.mark.usefixtures("without_pictures")
def test_a_plane_gap_is_the_same_on_any_mesh(nodes: tuple[int, int], tmp_path: Path) -> None:
    bare = two_parts(160.0, 80.0, (9, 5), "south") + PLANE
    first = write(tmp_path / "first.toml", bare)
    second = write(tmp_path / "second.toml", bare.replace("nodes = [9, 5]", f"nodes = {list(nodes)}"))
    done = harness("solve", first, second, "--out", tmp_path / "both", "--allow-gap", 0.2)
    assert done.exit_code == 4, done.output
    table = rows(tmp_path / "both" / "contacts.csv")
    assert len(table) == min(45, nodes[0] * nodes[1])
    for row in table:
        plane = 0.1 + 1e-3 * float(row["x_mm"]) + 5e-4 * float(row["y_mm"])
        for side in ("first", "second"):
            assert float(row[f"gap_after_{side}_mm"]) == pytest.approx(plane, abs=1e-12)
    assert "both are FAIL" in (tmp_path / "both" / "comparison.md").read_text()


@pytest.mark.parametrize("turned", [False, True])
def test_superelements_are_compared_where_both_have_contacts(turned: bool, tmp_path: Path) -> None:
    """Scattered nodes and a grid over the same square: a linear field is the same at all common places."""
    rng = np.random.default_rng(0)
    square = np.array([[0.0, 0.0], [90.0, 0.0], [0.0, 90.0], [90.0, 90.0]])
    grid = np.stack(np.meshgrid(*2 * [np.linspace(0.0, 90.0, 7)]), axis=-1).reshape(-1, 2)
    scenes = []
    for name, nodes in (("few", np.concatenate([square, rng.uniform(5, 85, (20, 2))])), ("many", grid)):
        (tmp_path / name).mkdir()
        scenes.append(write(tmp_path / f"{name}.toml", ""))
        for part, height in (("a", 0.0), ("b", 1.0)):
            xyz = np.column_stack([nodes, np.full(len(nodes), height)])
            table = write_part(tmp_path / name, part, np.eye(len(nodes)), xyz)
            keys = "\n".join(f"{key} = '{value}'" for key, value in table.items())
            scenes[-1].write_text(f"{scenes[-1].read_text()}[[joint.part]]\n{keys}\n")
    ((few, many),) = common_places(*map(str, scenes[:: -1 if turned else 1])) or []
    places = [read_scene(str(path)).joint.places(("a", "b")) for path in scenes]  # type: ignore[attr-defined]
    one, other = (W @ at for W, at in zip((few, many), places[:: -1 if turned else 1], strict=True))
    assert len(one) == 24
    np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.mark.usefixtures("without_pictures")
def test_the_mesh_decides_a_verdict_near_the_limit(tmp_path: Path) -> None:
    """Every second line of the fine mesh is one of the coarse mesh: there nothing is interpolated."""
    first = write(tmp_path / "coarse.toml", JOINT + FASTENERS)
    second = write(tmp_path / "fine.toml", (JOINT + FASTENERS).replace("nodes = [9, 5]", "nodes = [17, 9]"))
    harness("solve", first, second, "--out", tmp_path / "once")
    gaps = gaps_of(tmp_path / "once")
    at_coarse = gaps[1].reshape(9, 17)[::2, ::2].ravel()
    table = rows(tmp_path / "once" / "contacts.csv")
    change = np.array([float(row["change_mm"]) for row in table])
    np.testing.assert_allclose(change, at_coarse - gaps[0], atol=1e-14)
    assert 0 < abs(change).max() < 0.1
    between = sum(gap.max() for gap in gaps) / 2
    done = harness("solve", first, second, "--out", tmp_path / "both", "--allow-gap", between)
    sides = ["FAIL" if gap.max() > between else "PASS" for gap in gaps]
    assert sides[0] != sides[1]
    assert f"the mesh decides: first {sides[0]}, second {sides[1]}" in done.output.replace("\n", " ")


@pytest.mark.usefixtures("without_pictures")
def test_the_page_of_two_meshes_says_what_each_answer_says(tmp_path: Path) -> None:
    """The largest gap of the fine mesh is between the lines of the coarse one; nothing closes."""
    places = [(20.0 * x, 20.0 * y) for y in range(5) for x in range(9)]
    points = [[x, y, 0.3 if (x, y) == (20.0, 20.0) else 0.1] for x, y in places]
    gap = f'[[effect]]\nkind = "measured_gap"\npoints = {points}\n'
    scenes = []
    for name, nodes in (("coarse", (5, 3)), ("fine", (9, 5))):
        scenes.append(write(tmp_path / f"{name}.toml", two_parts(160.0, 80.0, nodes, "south") + gap))
    assert harness("solve", *scenes, "--out", tmp_path, "--allow-gap", 0.2).exit_code == 4
    common = [float(row["gap_after_second_mm"]) for row in rows(tmp_path / "contacts.csv")]
    assert max(common) == pytest.approx(0.1)
    page = (tmp_path / "index.html").read_text("utf-8")
    for name, largest in (("first", "0.100 mm"), ("second", "0.300 mm")):
        sentence = headline(*read(tmp_path / name))["text"]
        assert f"the largest gap left is {largest}" in sentence
        assert sentence in page


def test_the_starter_is_a_scene_that_is_solved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("report.writers.answer_report.answer_figures", lambda *_: {})
    path = tmp_path / "new" / "joint.toml"
    succeeds("init", path)
    succeeds("validate", path)
    succeeds("solve", path, "--out", tmp_path / "out", "--allow-gap", 0.05)
    assert json.loads((tmp_path / "out" / "solution.json").read_text())["qp"]
    comments = [line for line in path.read_text().splitlines() if line.startswith("# kind")]
    assert len(comments) >= 3
    assert f"solve {path}" in path.read_text()


def test_what_the_starter_offers_in_comments_is_valid(tmp_path: Path) -> None:
    """Each commented table, switched on."""
    text = STARTER.read_text("utf-8")
    tables = [block for block in text.split("\n\n") if "# [[effect]]" in block]
    assert len(tables) == 3
    write(tmp_path / "gaps.csv", "x,y,gap\n0,0,0.3\n600,0,0.3\n0,120,0.4\n")
    for block in tables:
        lines = block[block.index("# [[effect]]") :].splitlines()
        on = "\n".join(line.removeprefix("# ") for line in lines)
        path = write(tmp_path / "on.toml", text + "\n" + on)
        assert len(read_scene(str(path)).effects) == 3  # type: ignore[attr-defined]


def test_init_overwrites_nothing(tmp_path: Path) -> None:
    path = write(tmp_path / "mine.toml", "title = 'mine'")
    assert harness("init", path).exit_code == 2
    assert path.read_text() == "title = 'mine'"
    assert harness("init", tmp_path / "joint.txt").exit_code == 2


@pytest.mark.parametrize("other", [{"n": 3}, {"A": -1.0}])
def test_own_matrices_with_other_rows_are_refused(other: dict[str, float], tmp_path: Path) -> None:
    """As many contacts, but of other unknowns or the other way round."""
    paths = []
    for k, asked in enumerate(({}, other)):
        n = int(asked.get("n", 2))
        paths.append(tmp_path / f"{k}.npz")
        A = asked.get("A", 1.0) * np.eye(n, 1)
        np.savez(paths[-1], K=np.eye(n), A=A, f=np.full(n, 2.0), g=np.ones(1))
    done = harness("solve", *paths, "--out", tmp_path / "both")
    assert done.exit_code == 5, done.output
    assert "A of shape" in done.output
    assert not (tmp_path / "both").exists()
