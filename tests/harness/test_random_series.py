"""A series with random keys: its rows, the scene's own table, resumption, and searches that draw the same."""

from math import inf
from pathlib import Path

import numpy as np
import pytest
from commands import harness, wrong_usage
from refusals import refusal_of
from strip_scene import STRIP

from harness import shim
from harness.placement.session import PlanSession, Question
from harness.results import series_file
from harness.scene.solution import solve
from harness.series.derivatives import derivatives
from harness.series.load_case_source import GapCases
from harness.series.session import Job
from harness.shimming.patches import patches_of
from harness.shimming.study import ShimStudy
from problems.errors import InputError
from problems.load_cases.random_inputs import RandomInputs
from problems.load_cases.stream import drawn_cases
from problems.model.scene import JointScene
from problems.scene_files import read_scene
from rivetbench import run_series

TABLE = '\n[random]\nfasteners.preload = "each normal(60, 5)"\npressure.value = "uniform(0, 2e-4)"\n'


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(STRIP + TABLE, "utf-8")
    return path


def rows_of(directory: Path) -> list[dict[str, object]]:
    timed = ("solve_s", "form_s", "setup_s", "commit", "clean", "warm_from")
    return [{key: row[key] for key in row if key not in timed} for row in series_file.rows(directory)]


@pytest.mark.usefixtures("without_report", "without_pictures")
def test_the_table_of_a_scene_and_its_options_are_drawn(scene: Path, tmp_path: Path) -> None:
    more = "--random", "pressure.value=norm(1e-4, 1e-6)", "--allow-gap", 0.4
    for out, counts in (("once", (9,)), ("twice", (4, 9))):
        for count in counts:
            done = harness("series", scene, "--cases", count, *more, "--out", tmp_path / out)
            assert done.exit_code == 4, done.output
    assert "the share of joints is " in done.output
    once = rows_of(tmp_path / "once")
    assert [row["verdict"] for row in once] == ["within"] * 9
    for row, again in zip(once, rows_of(tmp_path / "twice"), strict=True):
        assert len(row["fasteners.preload"]) == 3
        assert abs(row["pressure.value"] - 1e-4) < 6e-6
        assert row.keys() == again.keys()
        assert row["max_gap_mm"] == pytest.approx(again["max_gap_mm"], abs=1e-9)
        assert all(row[key] == again[key] for key in row if "." in key)
    assert "cases_key" in wrong_usage("series", scene, "--cases", 9, "--out", tmp_path / "once")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--random", "ribs.I=uniform(60, 20)"), "N of DISTRIBUTION: it changes K"),
        (("--random", "pressure.value=norm()", "--sweep", "initial_gap.mean=1,2"), "random gaps, --gaps or"),
    ],
)
def test_bad_random_keys_are_refused(
    scene: Path, tmp_path: Path, options: tuple[str, ...], said: str
) -> None:
    assert said in wrong_usage("series", scene, *options, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_number_of_the_field_is_random_or_an_option(tmp_path: Path) -> None:
    """In a search, too, and by the table of a scene; the others may be options."""
    path = tmp_path / "scene.toml"
    path.write_text(STRIP + '\n[random]\ninitial_gap.mean = "normal(0.6, 0.05)"\n')
    scene = read_scene(str(path))
    both = GapCases(mean=0.3, sd=0.05, random=("initial_gap.random.sd=uniform(0.1, 0.1)",))
    assert [fault.where for fault in refusal_of(both.of_search, scene, "dual").faults] == ["--mean", "--sd"]
    cases = GapCases(sd=0.05).of(scene, "dual")
    assert isinstance(cases, RandomInputs)
    assert cases.gaps is not None
    assert cases.gaps.field.random is not None
    assert cases.gaps.field.random.sd == 0.05


@pytest.mark.usefixtures("without_pictures")
def test_a_sweep_leaves_the_table_out(scene: Path, tmp_path: Path) -> None:
    done = harness("series", scene, "--sweep", "initial_gap.mean=0.2,0.4", "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert not any("fasteners.preload" in row for row in rows_of(tmp_path / "out"))
    assert (tmp_path / "out/report/sweep-initial_gap.mean.csv").exists()


def test_a_key_of_K_has_a_K_for_each_of_its_values(tmp_path: Path) -> None:
    """Each case is the scene with the values of its row, the weight of the pad included."""
    pad = 'kind = "local_thickness"\npart = "a"\nthickness = 4.0\nx = [0.0, 200.0]\ny = [0.0, 120.0]'
    text = f'{STRIP}[[effect]]\n{pad}\n[[effect]]\nkind = "self_weight"\npart = "a"\n'
    path = tmp_path / "pad.toml"
    path.write_text(text)
    laws = {"ribs.I": "3 of uniform(1000, 3000)", "local_thickness.thickness": "2 of uniform(4, 2)"}
    laws["pressure.value"] = "uniform(0, 2e-4)"
    source = GapCases(random=tuple(f"{name}={law}" for name, law in laws.items()), contributors=2)
    assert run_series(path, tmp_path / "out", source, report=False).code == 0
    rows = rows_of(tmp_path / "out")
    middles = {"ribs.I": (1500, 2500, 3500), "local_thickness.thickness": (4.5, 5.5)}
    for name, values in middles.items():
        assert {round(row[name], 4) for row in rows} <= {*values}
    assert len({(row["ribs.I"], row["local_thickness.thickness"]) for row in rows}) > 2
    read = read_scene(str(path))
    drawn = source.of(read, "dual", stiffness=True)
    for row in rows:
        assert drawn.parameters(row["case"]).items() <= row.items()
        shown = text.replace("I = 2e3", f"I = {row['ribs.I']!r}").replace(
            "seed = 7", f"seed = {row['gap_seed']}"
        )
        shown = shown.replace("thickness = 4.0", f"thickness = {row['local_thickness.thickness']!r}")
        path.write_text(shown.replace("value = 1e-4", f"value = {row['pressure.value']!r}"))
        assert row["max_gap_mm"] == pytest.approx(solve(read_scene(str(path))).gap.max(), abs=1e-9)
    slopes = derivatives(Job(scene=read, cases=drawn, form="dual"))["derivative"]
    assert np.isnan(slopes).tolist() == [True, True, False]


@pytest.mark.usefixtures("without_pictures")
def test_searches_draw_what_a_series_draws(scene: Path, tmp_path: Path) -> None:
    """The proven gaps of the scene's own fasteners, and the largest of the preloads that are drawn."""
    assert harness("series", scene, "--cases", 3, "--out", tmp_path / "series").exit_code == 0
    rows, read = rows_of(tmp_path / "series"), read_scene(str(scene))
    assert isinstance(read, JointScene)
    cases = GapCases(count=3).of_search(read, "dual")
    session = PlanSession(ShimStudy(read, read, cases, "dual", patches_of(read.joint, "1x1"), (1e9, inf)))
    (outcome,) = session.answer(Question(((),), (0, 1, 2)))
    assert outcome.largest == pytest.approx([row["max_gap_mm"] for row in rows], abs=1e-7)
    forces = [max(np.ravel(row["fasteners.preload"])) for row in rows]
    assert [figures[-2] for figures in outcome.further] == pytest.approx(forces)


def test_what_searches_cannot_draw_is_refused(scene: Path, tmp_path: Path) -> None:
    shims = "shim", scene, "--allow-gap", 0.1, "--stock", 0.1
    for words, said in (
        (("place", scene, "--count", 1), "the fasteners change places"),
        (("place", scene, "--count", 1, "--random", " fasteners.preload=norm(9, 1)"), "the fasteners change"),
        ((*shims, "--allow-stress", 100), "loads are the scene's"),
    ):
        assert said in wrong_usage(*words, "--out", tmp_path / "out")
    drawn = GapCases(random=("pressure.value=norm()",), contributors=2)
    with pytest.raises(InputError, match="not independent"):
        shim(scene, tmp_path / "out", allow_gap_mm=0.1, stock="0.1", cases=drawn)
    with pytest.raises(InputError, match="draws gaps alone"):
        drawn_cases(read_scene(str(scene)), "dual", cases=2, seed=0)
