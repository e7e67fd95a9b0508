"""Answers while fasteners move, against `solve` on the scene as it is saved; wrong values; words."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from queue import Queue
from threading import Event
from typing import Any

import numpy as np
import pytest
from bokeh.document import Document
from commands import harness, wrong_usage
from refusals import refusal_of
from small_joints import FASTENERS, GAP, scene_at, two_parts

from harness import solve
from harness.explore import page as explore_page
from harness.explore.live_answers import CHANGED, Explorer, Settings
from harness.explore.raster import Raster
from harness.scene.scene_file import edited
from problems.errors import InputError

PRESSURE = """
[[effect]]
kind = "pressure"
part = "a"
value = 1e-4
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("explore") / "strip.toml"
    path.write_text(two_parts(length=200.0, nodes=(21, 4)) + GAP + FASTENERS + PRESSURE)
    return path


def staged(path: Path, preload: float = 0.0) -> str:
    """The scene of `path` with stages: tacked, riveted twice, in a hole of a tack, too, let go."""
    rivets = f"stiffness = 3e3\npreload = {preload}\npoints = [[35.0, 15.0], [20.0, 10.0], [150.0, 20.0]]\n"
    text = path.read_text().replace('"fasteners"', '"fasteners"\nname = "tacks"')
    text += f'[[effect]]\nkind = "installed_fasteners"\nname = "rivets"\n{rivets}'
    for name, on, off in (
        ("tack", ["tacks"], []),
        ("rivet", ["rivets[0:1]"], []),
        ("fill", ["rivets[1:3]"], ["rivets[0:1]"]),
        ("release", [], ["tacks"]),
    ):
        text += f'[[stage]]\nname = "{name}"\non = {on}\noff = {off}\n'
    return text


@pytest.mark.parametrize(
    ("form", "preload", "problems", "fewer"),
    [
        ("dual", None, [1, 1], 1),
        ("sparse", None, [1, 1], 1),
        ("dual", 25.0, [3, 6], 3),
        ("sparse", 0.0, [2, 4], 3),
    ],
)
def test_an_answer_is_that_of_the_scene_as_it_is_saved(
    path: Path, tmp_path: Path, form: Any, preload: float | None, problems: list[int], fewer: int
) -> None:
    """After moves, each from the answer before. A stage is solved again if its rivets have a preload.

    preload : of the rivets; None without stages. problems : the number of different K, and of the problems
    that are solved. fewer : the fasteners that are left after a move.
    """
    scene = tmp_path / "scene.toml"
    scene.write_text(path.read_text() if preload is None else staged(path, preload))
    explorer = Explorer(scene_at(scene), form)
    assert [len(set(map(id, explorer.sessions))), len(explorer.sessions)] == problems
    settings, answer = explorer.settings, None
    moved = (*settings.places[:2], (123.4, 40.0))
    for k, change in enumerate(
        (
            {},
            {"places": moved},
            {"places": moved[:fewer], "preload": 55.0},
            {"means": (0.08,), "pressures": (-2e-4,)},
        )
    ):
        settings = replace(settings, **change)  # type: ignore[arg-type]
        quick = explorer.answer(settings, answer)
        answer = explorer.proven(quick)
        saved = tmp_path / f"{k}.toml"
        saved.write_text(edited(str(scene), tmp_path, settings.write_to, CHANGED))
        assert Settings.of(scene_at(saved)) == settings
        solution = solve(str(saved), form=form)
        assert [live.stage for live in answer.stages] == [exact.name for exact in solution.stages]
        of_solve: list[Any] = [*solution.stages, solution]
        for live, exact in zip((*answer.stages, answer), of_solve, strict=True):
            assert live.error_mm is not None
            assert live.error_mm <= 1e-6
            assert abs(live.gap - exact.gap).max() <= live.error_mm + 1e-7
            np.testing.assert_allclose(live.lam.sum(), exact.lam.sum(), atol=1e-3)
        for rough, exact in zip(quick.stages, solution.stages, strict=True):
            assert rough.stage == exact.name
            assert abs(rough.gap - exact.gap).max() <= 1e-5
        if answer.stages:
            np.testing.assert_array_equal(answer.gap, answer.stages[-1].gap)
        rtol, atol = (1e-12, 1e-12) if preload is None else (1e-9, 1e-6)
        np.testing.assert_allclose(answer.load.f, solution.problem.load.f, rtol=rtol, atol=atol)
    assert preload is None or abs(answer.stages[0].gap - answer.gap).max() > 0.01


def test_without_a_fastener_the_gap_stays_open(path: Path) -> None:
    explorer = Explorer(scene_at(path), "dual")
    near = explorer.answer(replace(explorer.settings, means=(0.08,), pressures=(-2e-4,)))
    answer = explorer.proven(explorer.answer(replace(near.settings, places=()), near))
    assert answer.gap.max() > 0.05


def test_an_answer_to_unproven_approaches_is_not_proven(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the second stage locks is known to a millimetre; its own gaps are proven."""
    (tmp_path / "scene.toml").write_text(staged(path))
    explorer = Explorer(scene_at(tmp_path / "scene.toml"))
    first = explorer.sessions[0]
    proven = first.proven
    monkeypatch.setattr(first, "proven", lambda *of: (*proven(*of)[:3], 1.0))
    stages = explorer.proven(explorer.answer(explorer.settings)).stages
    assert np.isfinite([stage.error_mm for stage in stages]).tolist() == [True, True, False, False]


def test_a_shifted_support_stays_in_a_scene_with_stages(path: Path, tmp_path: Path) -> None:
    """What stages set is looked at in each of them: a support that none has is still refused."""
    place = 'part = "a"\npoints = [[100.0, 70.0]]\n'
    supports = f'[[effect]]\nkind = "supports"\nname = "prop"\n{place}'
    shift = f'[[effect]]\nkind = "support_shift"\n{place}shift = 0.1\n'
    (tmp_path / "scene.toml").write_text(staged(path) + supports + shift)
    scene = scene_at(tmp_path / "scene.toml")
    settings = Settings.of(scene)
    assert len(settings.applied(scene)) == len(scene.effects)
    alone = replace(scene, effects=tuple(e for e in scene.effects if e.kind != "supports"))
    with pytest.raises(InputError, match="a point of a supports effect of part a"):
        settings.applied(alone)


ANOTHER = """
[[effect]]
kind = "fasteners"
preload = 40.0
points = [[100.0, 10.0]]
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[[stage]]", ANOTHER + "[[stage]]", "one table, set by its name"),
        ("points = [[20.0", 'file = "tacks.csv"  # [[20.0', "not by a column stage"),
    ],
)
def test_stages_set_one_table_of_fasteners_that_move(
    path: Path, tmp_path: Path, old: str, new: str, said: str
) -> None:
    (tmp_path / "tacks.csv").write_text("x,y,stage\n20,10,tack\n50,25,rivet\n")
    scene = tmp_path / "scene.toml"
    text = staged(path).replace(old, new, 1)
    scene.write_text(text.replace("on = ['tacks']", "on = []") if "csv" in new else text)
    with pytest.raises(InputError, match=said):
        Explorer(scene_at(scene), "dual")


def test_an_answer_of_another_explorer_is_refused(path: Path, tmp_path: Path) -> None:
    """Its overlap is that of other matrices. So is an unknown form."""
    (tmp_path / "thicker.toml").write_text(path.read_text().replace("thickness = 2.0", "thickness = 4.0"))
    explorers = [Explorer(scene_at(file), "dual") for file in (path, tmp_path / "thicker.toml")]
    settings, (one, other) = explorers[0].settings, explorers
    for refused in (partial(one.answer, settings), one.proven):
        with pytest.raises(InputError, match="of another Explorer"):
            refused(other.answer(settings))
    with pytest.raises(InputError, match="--form: form = 'full'"):
        Explorer(scene_at(path), "full")  # type: ignore[arg-type]


def test_each_initial_gap_keeps_its_own_mean(tmp_path: Path) -> None:
    third = two_parts().split("[[joint.part]]")[2].replace('"b"', '"c"')
    gap = '[[effect]]\nkind = "initial_gap"\nbetween = {}\nmean = {}\n'
    gaps = gap.format(["a", "b"], 0.01) + gap.format(["b", "c"], 0.7)
    path = tmp_path / "three.toml"
    path.write_text(f"{two_parts()}[[joint.part]]{third}{gaps}{FASTENERS}")
    explorer = Explorer(scene_at(path), "dual")
    answer = explorer.proven(explorer.answer(explorer.settings))
    assert abs(answer.gap - solve(str(path)).gap).max() <= 1e-7
    assert answer.settings.means == (0.01, 0.7)


def test_what_is_in_the_file_of_the_assembly_cannot_be_saved_changed(tmp_path: Path) -> None:
    (tmp_path / "joint.toml").write_text(
        two_parts().replace("[joint]", "").replace("joint.part", "part") + PRESSURE
    )
    path = tmp_path / "scene.toml"
    path.write_text(f'assembly = "joint.toml"\n{GAP}{FASTENERS}')
    settings = Settings.of(scene_at(path))
    assert settings.pressures == (1e-4,)
    with pytest.raises(InputError, match=r"joint\.toml: effect = \['pressure'\]: these in the scene itself"):
        edited(str(path), tmp_path, settings.write_to, CHANGED)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"places": ((500.0, 10.0),)}, ["fasteners.points[0]", "[500.0, 10.0]", "on the junction"]),
        ({"preload": 0.0}, ["fasteners.preload", "0.0", "greater than 0"]),
        ({"means": ()}, ["page: means = (): as many as in the scene, 1"]),
        ({"means": 0.3}, ["page: means = 0.3: as many as in the scene, 1"]),
        ({"places": np.ones((2, 2))}, ["fasteners.points[1]", "separate places"]),
        (
            {"means": (float("nan"),), "preload": -1.0},
            ["initial_gap.mean", "nan", "fasteners.preload", "-1.0"],
        ),
    ],
)
def test_wrong_values_are_refused_as_by_validate(path: Path, change: dict[str, Any], said: list[str]) -> None:
    scene = scene_at(path)
    refused = str(refusal_of(replace(Settings.of(scene), **change).applied, scene))
    for word in said:
        assert word in refused


INSTALLED = """
[[effect]]
kind = "installed_fasteners"
points = [[150.0, 25.0]]
"""


def page_of(path: Path, text: str) -> Any:
    """A page of a scene as in a browser, without one."""
    path.write_text(text)
    explorer = Explorer(scene_at(path), "dual")
    return explore_page.Page(explorer, str(path), 0.05, explorer.answer(explorer.settings), Document())


def dragged(page: Any, x: float, y: float) -> None:
    page.fasteners.data = {"x": [x, 50.0, 80.0], "y": [y, 25.0, 40.0]}


def test_what_solve_would_refuse_is_refused_on_the_page(path: Path, tmp_path: Path) -> None:
    """A fastener on an installed one, whose own effect does not change; nothing is saved then."""
    page = page_of(tmp_path / "scene.toml", path.read_text() + INSTALLED)
    page.path.value = str(tmp_path / "moved.toml")
    dragged(page, 150.0000004, 25.0)
    said = "points = [[150.0, 25.0]]: separate places: fasteners acts at the same ones"
    assert f"page: installed_fasteners.{said}" in page.fault.text
    page.save()
    assert said in page.fault.text
    assert "moved.toml: effect[" in page.fault.text
    assert not (tmp_path / "moved.toml").exists()
    dragged(page, 149.0, 25.0)
    assert page.fault.text == ""


def test_a_stage_is_chosen_on_the_page(path: Path, tmp_path: Path) -> None:
    """The last one at first; a scene without stages has no choice. What a stage sets has to stay."""
    assert not page_of(tmp_path / "plain.toml", path.read_text()).stage.visible
    page = page_of(tmp_path / "scene.toml", staged(path))
    exact = solve(str(tmp_path / "scene.toml")).stages
    assert page.stage.options == ["tack", "rivet", "fill", "release"]
    for k in (3, 0):
        page.stage.value = exact[k].name
        page.prove()
        assert f"after {exact[k].name}: largest gap" in page.outcome.text
        assert f'id="gap">{exact[k].gap.max():.6g}<' in page.outcome.text
        shown = page.cells.data["gap"][0]
        np.testing.assert_allclose(np.nanmax(shown), exact[k].gap.max(), atol=1e-5)
    dragged(page, 120.0, 12.0)
    assert page.shown.stage == "tack"
    assert page.fault.text == ""
    page.fasteners.data = {"x": [], "y": []}
    assert "page: stage[0] (tack).on = &#x27;tacks&#x27;: " in page.fault.text


def test_a_dropped_fastener_is_solved_and_saved_to_the_micrometre(path: Path, tmp_path: Path) -> None:
    """Those that were not moved stay where they are, to the last bit."""
    text = path.read_text().replace("[50.0, 25.0]", "[50.123456789, 25.0]")
    page = page_of(tmp_path / "scene.toml", text)
    page.fasteners.data = {"x": [77.0101465599032, 50.123456789], "y": [12.3456789, 25.0]}
    assert page.answer.settings.places == ((77.01, 12.346), (50.123456789, 25.0))
    page.path.value = str(tmp_path / "moved.toml")
    page.save()
    assert Settings.of(scene_at(tmp_path / "moved.toml")) == page.answer.settings


def test_a_file_that_has_changed_is_not_saved_with_the_answer_to_the_old_one(
    path: Path, tmp_path: Path
) -> None:
    """An effect was added; what is no change of the scene, as a comment, is saved with it."""
    scene, moved, text = tmp_path / "scene.toml", tmp_path / "moved.toml", path.read_text()
    page = page_of(scene, text)
    page.path.value = str(moved)
    scene.write_text(text + PRESSURE.replace('"a"', '"b"'))
    page.save()
    assert "has changed since it was read: start explore again" in page.fault.text
    assert not moved.exists()
    scene.write_text(text + "# noted\n")
    page.save()
    assert moved.read_text().endswith("# noted\n")


def test_laws_of_tables_that_become_one_are_not_saved(path: Path, tmp_path: Path) -> None:
    law = '[random]\n"fasteners.0.preload" = "normal(40, 1)"\n'
    page = page_of(tmp_path / "scene.toml", path.read_text() + ANOTHER + law)
    page.path.value = str(tmp_path / "moved.toml")
    page.save()
    assert "[random]: key = &#x27;fasteners.0.preload&#x27;: one of" in page.fault.text
    assert not (tmp_path / "moved.toml").exists()


def test_a_scene_written_through_links_finds_its_files(tmp_path: Path) -> None:
    """From a linked folder to another, as on clusters; a file that is a link itself keeps its name.

    Comments stay.
    """
    home, far = tmp_path / "a" / "home", tmp_path / "b" / "c" / "far"
    home.mkdir(parents=True)
    far.mkdir(parents=True)
    (tmp_path / "joint").symlink_to(home)
    (tmp_path / "results").symlink_to(far)
    (tmp_path / "store").write_text("x,y,gap\n0,0,0.1\n100,50,0.2\n0,50,0.1\n100,0,0.1\n")
    (home.parent / "gap.csv").symlink_to(tmp_path / "store")
    scene = home / "scene.toml"
    measured = '[[effect]]\nkind = "measured_gap"\nfile = "../gap.csv"  # of the scan\n'
    scene.write_text(two_parts() + measured + FASTENERS, "utf-8")
    text = edited(str(tmp_path / "joint/scene.toml"), tmp_path / "results", lambda _: None, CHANGED)
    (far / "scene.toml").write_text(text, "utf-8")
    assert '"../../../a/gap.csv"' in text
    assert "# of the scan" in text
    assert scene_at(tmp_path / "results/scene.toml").key == scene_at(scene).key


@pytest.mark.parametrize(
    ("scene", "said"),
    [("hard/duplicates/2e-05", "own matrices"), ("gallery/heavy-sheet-on-tool", "no fasteners")],
)
def test_scenes_without_fasteners(scene: str, said: str) -> None:
    assert said in wrong_usage("explore", scene, "--no-open")


def test_a_browser_in_the_terminal_gets_the_page(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Which `webbrowser.open` waits for: the page is served meanwhile."""
    served, asked = Event(), Queue[tuple[str, bool]]()

    def serve(*of: Any) -> None:
        of[-1]("http://localhost")
        served.set()

    monkeypatch.setattr(explore_page, "serve", serve)
    monkeypatch.setattr("webbrowser.open", lambda address: asked.put((address, served.wait(5))))
    assert harness("explore", path).exit_code == 0
    assert asked.get(timeout=10) == ("http://localhost", True)


def test_the_outcome_in_words(path: Path) -> None:
    explorer = Explorer(scene_at(path), "dual")
    answer = explorer.answer(explorer.settings)
    places, largest = explorer.data.assembly.contact_nodes, float(answer.gap.max())
    assert ">FAIL<" in explore_page.outcome(answer, places, largest / 2)
    assert ">PASS<" in explore_page.outcome(answer, places, largest * 2)
    proven = explorer.proven(answer)
    assert "proven" in explore_page.outcome(proven, places, largest * 2)
    unsure = replace(proven, error_mm=largest)
    assert ">cannot be told<" in explore_page.outcome(unsure, places, largest * 1.1)


def test_the_raster_shows_every_contact_where_it_is() -> None:
    """A full grid in any order has a pixel per contact; places all over keep theirs; a hole is left empty."""
    random = np.random.default_rng(0)
    grid = np.stack(np.meshgrid(np.arange(9) * 3.0, np.arange(4) * 5.0), axis=-1).reshape(-1, 2)
    order = random.permutation(len(grid))
    gap = np.arange(36.0)
    raster = Raster.of(grid[order])
    np.testing.assert_array_equal(raster.image(gap[order]), gap.reshape(4, 9))
    np.testing.assert_array_equal([raster.low, raster.high], [[-1.5, -2.5], [25.5, 17.5]])
    stack = Raster.of(np.concatenate([grid, grid]))
    np.testing.assert_array_equal(stack.image(np.r_[gap, 35 - gap]), np.maximum(gap, 35 - gap).reshape(4, 9))
    scattered = random.uniform(0, 100, (400, 2))
    scattered = scattered[np.hypot(*(scattered - 50.0).T) > 25]
    raster = Raster.of(scattered)
    image = raster.image(np.arange(float(len(scattered))))
    rows, columns = image.shape
    shown = ((scattered - raster.low) / (raster.high - raster.low) * (columns, rows)).astype(int)
    near = scattered[image[shown[:, 1], shown[:, 0]].astype(int)]
    assert np.hypot(*(near - scattered).T).max() < 5.0
    assert np.isnan(image[rows // 2, columns // 2])
    assert image.size <= 4.5 * len(scattered) / (1 - np.pi / 16)
