"""Fasteners with a preload each, from a column of their CSV: forces, subsets, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from commands import harness, wrong_usage
from refusals import refusal_of
from small_joints import two_parts

from harness.scene.scene_file import MOVED, edited, with_fasteners
from problems.effects.fasteners import Fasteners
from problems.effects.installed_fasteners import InstalledFasteners
from problems.input.tables import read_columns
from problems.load_cases.random_gaps import random_gaps
from problems.load_cases.stream import Stream
from problems.model.fastener_forces import fastener_forces
from problems.model.scene import JointScene
from problems.scene_files import read_scene
from rivetbench import GapCases, run_series

HOLES = [(20.0, 10.0, 300.0), (50.0, 25.0, 50.0), (81.0, 33.0, 120.0)]
KINDS = (Fasteners, InstalledFasteners)


def scene_of(folder: Path, effect: str, holes: str) -> JointScene:
    (folder / "holes.csv").write_text(holes)
    gap = '[[effect]]\nkind = "initial_gap"\nmean = 0.2\n'
    random = "random = { sd = 0.02, correlation_length = 60.0, seed = 3 }\n"
    (folder / "scene.toml").write_text(
        two_parts() + gap + random + f'[[effect]]\nfile = "holes.csv"\n{effect}\n'
    )
    scene = read_scene(str(folder / "scene.toml"))
    assert isinstance(scene, JointScene)
    return scene


def test_a_heading_that_begins_alike_is_another_column(tmp_path: Path) -> None:
    (tmp_path / "holes.csv").write_text("x,y,preload,preload_tool,preloaded\n10,20,300,7,yes\n")
    read = read_columns(tmp_path / "holes.csv", ("x", "y", "preload"))
    assert (read.rows, read.faults) == ([(10.0, 20.0, 300.0)], [])


def table(heading: str = "preload", factor: float = 1.0) -> str:
    return f"x,y,{heading}\n" + "".join(f"{x},{y},{factor * force}\n" for x, y, force in HOLES)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("heading", "factor", "columns"),
    [
        ("preload", 1.0, ""),
        ("Preload [kN]", 1e-3, ""),
        ("preload in kN", 1e-3, ""),
        ("preload_kN", 1e-3, ""),
        ("preload (kN)", 1e-3, ""),
        ("F1", 1.0, 'columns = { preload = "F1" }'),
    ],
)
def test_forces_are_the_sum_of_each(
    tmp_path: Path, kind: type[Fasteners], heading: str, factor: float, columns: str
) -> None:
    name = "fasteners" if kind is Fasteners else "installed_fasteners"
    scene = scene_of(tmp_path, f'kind = "{name}"\n{columns}', table(heading, factor))
    (effect,) = scene.effects_of(kind)
    np.testing.assert_allclose(effect.preload, [300.0, 50.0, 120.0], rtol=1e-15)
    single = [kind(kind=name, points=((x, y),), preload=force) for x, y, force in HOLES]
    joint = scene.joint
    force = sum(one.force(joint) for one in single)
    assert abs(force).max() > 1.0
    np.testing.assert_allclose(effect.force(joint), force, rtol=0, atol=1e-12 * abs(force).max())
    some = effect.only([2, 0], joint)
    assert (some.points, some.preload) == (
        (HOLES[2][:2], HOLES[0][:2]),
        (effect.preload[2], effect.preload[0]),
    )
    rows = list(fastener_forces(scene, np.zeros(joint.size[0])))
    np.testing.assert_allclose([row["force_N"] for row in rows], [300.0, 50.0, 120.0], rtol=1e-15)


def test_a_column_of_one_value_is_a_number(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, 'kind = "fasteners"', "x,y,preload\n20,10,70\n50,25,70\n")
    same = scene_of(tmp_path, 'kind = "fasteners"\npreload = 70', "x,y\n20,10\n50,25\n")
    assert scene.key == same.key
    scene_of(tmp_path, 'kind = "fasteners"', "x,y,preload\n20,10,70\n50,25,70\n")
    moved = edited(str(tmp_path / "scene.toml"), tmp_path, with_fasteners([(20.0, 10.0)], 70.0), MOVED)
    (tmp_path / "moved.toml").write_text(moved)
    (effect,) = read_scene(str(tmp_path / "moved.toml")).effects_of(Fasteners)
    assert (effect.points, effect.preload) == (((20.0, 10.0),), 70.0)


def test_a_stream_takes_out_each_with_its_preload(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, 'kind = "fasteners"', table())
    stream = Stream.of(scene, random_gaps(scene, 2, 1), "dual")
    assert [one.preload for one in stream.single] == [(300.0,), (50.0,), (120.0,)]


def test_series_and_answers_keep_it_and_place_refuses_it(tmp_path: Path) -> None:
    scene_of(tmp_path, 'kind = "fasteners"', table())
    cases = GapCases(count=2)
    assert run_series(tmp_path / "scene.toml", tmp_path / "series", cases, report=False).code == 0
    tables = [f'[[effect]]\nkind = "fasteners"\npoints = [[{x}, {y}]]\npreload = {p}\n' for x, y, p in HOLES]
    text = (tmp_path / "scene.toml").read_text()
    (tmp_path / "three.toml").write_text(text[: text.rindex("[[effect]]")] + "".join(tables))
    for name in ("scene", "three"):
        done = harness(
            "export", tmp_path / f"{name}.toml", "--format", "npz", "--out", tmp_path / f"{name}.npz"
        )
        assert done.exit_code == 0, done.output
    one, other = (np.load(tmp_path / f"{name}.npz")["f"] for name in ("scene", "three"))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * abs(other).max())
    assert abs(other).max() > 1.0
    told = wrong_usage("place", tmp_path / "scene.toml", "--allow-gap", 0.1, "--out", tmp_path / "plan")
    assert "fasteners.preload" in told
    assert "the same in all" in told


@pytest.mark.parametrize(
    ("effect", "holes", "said"),
    [
        (
            'kind = "fasteners"',
            table().replace("50.0\n", "-5\n"),
            "line 3 = -5.0: must be greater than 0; in N",
        ),
        ('kind = "fasteners"', table().replace("50.0\n", "\n"), "line 3"),
        ('kind = "fasteners"\npreload = 5', table(), "leave it out: holes.csv has a column preload"),
        ('kind = "fasteners"', "x,y\n20,10\n", "preload"),
        *(
            ('kind = "installed_fasteners"', table(heading), "a unit: -, n, kn")
            for heading in ("preload [bar]", "preload_lbf", "preload force [N]")
        ),
        ('kind = "installed_fasteners"', table("preload,stage,stage"), "preload, stage, once each"),
        ('kind = "installed_fasteners"\npreload = [1, 2]', "x,y\n20,10\n", "one for each of 1 points"),
        ('kind = "clamps"\nclamping_force = 5\ncolumns = { preload = "F" }', table("F"), "columns"),
        *(
            (effect, table(heading), f"header = '{heading}': no column {name}: a file has x, y")
            for effect, heading, name in (
                ('kind = "installed_fasteners"', "Approach [mm]", "approach"),
                ('kind = "clamps"\nclamping_force = 5', "clamping force (N)", "clamping_force"),
                ('kind = "fasteners"\npreload = 5', "Between", "between"),
            )
        ),
    ],
)
def test_bad_preloads_are_refused(tmp_path: Path, effect: str, holes: str, said: str) -> None:
    assert said in str(refusal_of(scene_of, tmp_path, effect, holes))
