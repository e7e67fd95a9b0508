"""Load cases of a series: random gaps, a table of measured ones, a sweep; and what is said of bad ones."""

import pickle
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import tiny_joint
from refusals import refusal_of
from small_joints import JOINT, make_scene, with_gap
from strip_scene import write_strip
from superelements import scene_from, with_bay

from problems.build import load_case
from problems.effects.fasteners import Fasteners
from problems.effects.installed_fasteners import InstalledFasteners
from problems.errors import InputError
from problems.input.tables import TableOptions
from problems.load_cases import LoadCases
from problems.load_cases.measured_gaps import measured_gaps
from problems.load_cases.random_gaps import random_gaps
from problems.load_cases.sweep import keys_of, sweep
from problems.model.scene import JointScene, Scene
from problems.scene_files import read_scene

M = 45  # contacts of the strip
RANDOM = "random = { sd = 0.2, correlation_length = 100.0, seed = 7 }"


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return read_scene(str(write_strip(tmp_path_factory.mktemp("strip"))))


def gaps_of(cases: LoadCases) -> np.ndarray:
    return np.array([cases.load(k).g for k in range(cases.count)])


def test_a_random_case_is_a_scene_with_the_seed_of_its_row(scene: Scene, tmp_path: Path) -> None:
    cases = random_gaps(scene, 20, seed=3)
    for k in (0, 7, 19):
        seed = cases.parameters(k)["gap_seed"]
        written = write_strip(tmp_path, ("seed = 7", f"seed = {seed}"))
        wanted = load_case(read_scene(str(written)))
        np.testing.assert_array_equal(cases.load(k).g, wanted.g)
        np.testing.assert_array_equal(cases.load(k).f, wanted.f)


def test_around_a_measured_gap_the_mean_is_zero(tmp_path: Path) -> None:
    old = f'kind = "initial_gap"\nmean = 0.4\n{RANDOM}'
    measured = 'kind = "measured_gap"\npoints = [[0.0, 0.0, 0.4], [400.0, 0.0, 0.4], [0.0, 120.0, 0.4]]'
    scene = read_scene(str(write_strip(tmp_path, (old, measured))))
    drawn = random_gaps(scene, 2, 3, sd=1e-3, correlation_length=50.0).load(0).g
    assert 0 < abs(drawn - load_case(scene).g).max() < 1e-2
    said = str(refusal_of(random_gaps, scene, 2, 3))
    assert "--sd" in said
    assert "--mean" not in said


def test_a_random_case_depends_on_seed_and_number_alone(scene: Scene) -> None:
    few, many = random_gaps(scene, 3, seed=3), random_gaps(scene, 300, seed=3)
    many.load(250)
    np.testing.assert_array_equal(gaps_of(few)[2], many.load(2).g)
    np.testing.assert_array_equal(many.load(250).g, pickle.loads(pickle.dumps(many)).load(250).g)
    assert few.key == many.key != random_gaps(scene, 3, seed=4).key
    drawn = {many.load(k).g.tobytes() for k in range(300)}
    others = {random_gaps(scene, 300, seed=4).load(k).g.tobytes() for k in range(300)}
    assert len(drawn | others) == 600
    assert many.load(0).f is many.load(1).f


def test_the_statistics_of_the_random_gaps(scene: Scene) -> None:
    """Mean, standard deviation and correlation over 2000 cases, each within four standard errors."""
    count, sd, length = 2000, 0.3, 80.0
    gaps = gaps_of(random_gaps(scene, count, 1, mean=0.5, sd=sd, correlation_length=length))
    assert abs(gaps.mean(axis=0) - 0.5).max() < 4 * sd / np.sqrt(count)
    assert abs(gaps.std(axis=0) / sd - 1).max() < 4 / np.sqrt(2 * count)
    nodes = scene.joint.nodes
    found = np.corrcoef(gaps.T)[0]
    wanted = np.exp(-0.5 * (np.linalg.norm(nodes - nodes[0], axis=1) / length) ** 2)
    assert abs(found - wanted).max() < 4 / np.sqrt(count)
    assert abs(np.corrcoef(gaps[:-1, 0], gaps[1:, 0])[0, 1]) < 4 / np.sqrt(count)  # case to case


def test_the_field_comes_from_the_options_where_the_scene_has_none(tmp_path: Path) -> None:
    bare = read_scene(str(write_strip(tmp_path, (RANDOM, ""))))
    said = str(refusal_of(random_gaps, bare, 5, 0))
    assert "--sd" in said
    assert "--correlation-length" in said
    assert "--mean" not in said
    assert random_gaps(bare, 5, 0, sd=0.1, correlation_length=50.0).load(3).g.std() > 0
    with pytest.raises(InputError, match="greater than 0"):
        random_gaps(bare, 5, 0, sd=-0.1, correlation_length=50.0)


def test_own_matrices_take_a_table_and_have_no_random_field(tmp_path: Path) -> None:
    own_scene = read_scene(str(tiny_joint.write_problem(tmp_path / "own.npz")))
    with pytest.raises(InputError, match="--gaps"):
        random_gaps(own_scene, 5, 0)
    gaps = np.full((2, 10), 0.25)
    np.savetxt(tmp_path / "gaps.csv", gaps, delimiter=",")
    case = measured_gaps(own_scene, tmp_path / "gaps.csv").load(1)
    np.testing.assert_array_equal(case.g, gaps[1])
    np.testing.assert_array_equal(case.f, np.load(tmp_path / "own.npz")["f"])
    gaps[1, 3] = 9999  # without places no other gap takes its place
    np.save(tmp_path / "gaps.npy", gaps)
    with pytest.raises(InputError, match="case 1, contact 3 = nan"):
        measured_gaps(own_scene, tmp_path / "gaps.npy", options=TableOptions(missing=(9999,)))


@pytest.mark.parametrize("kind", ["csv", "npz", "npy"])
def test_a_table_takes_the_place_of_the_gaps(kind: str, scene: Scene, tmp_path: Path) -> None:
    gaps = np.random.default_rng(0).uniform(0, 1, (30, M))
    path = tmp_path / f"gaps.{kind}"
    match kind:
        case "csv":
            np.savetxt(path, gaps, fmt="%.17g", delimiter=",", header="measured on Monday")
        case "npz":
            np.savez(path, gaps=gaps, other=np.zeros(3))
        case "npy":
            np.save(path, gaps)
    cases = measured_gaps(scene, path)
    assert cases.count == 30
    # pandas before 3.1 reads the last digits of a text inexactly
    np.testing.assert_allclose(gaps_of(cases), gaps, rtol=0, atol=1e-15 if kind == "csv" else 0)
    np.testing.assert_array_equal(cases.load(0).f, load_case(scene).f)
    assert measured_gaps(scene, path, 4).count == 4
    with pytest.raises(InputError, match="has 30 rows"):
        measured_gaps(scene, path, 31)


def test_a_row_of_a_table_stands_for_the_gaps_that_are_measured(tmp_path: Path) -> None:
    """A case is the scene with a scan of the row's gaps, whatever shims, position and tool it has."""
    more = '[[effect]]\nkind = "shims"\nthickness = 0.3\nx = [0.0, 200.0]\ny = [0.0, 120.0]\n'
    more += '[[effect]]\nkind = "part_position"\npart = "a"\nshift = 0.05\nslope_x = 1e-4\n'
    more += '[[effect]]\nkind = "rigid_tool"\npart = "a"\ndistance = 0.2\ncurvature = [1e-6, 0.0]\n'
    scene = read_scene(
        str(write_strip(tmp_path, ('[[effect]]\nkind = "ribs"', more + '[[effect]]\nkind = "ribs"')))
    )
    assert isinstance(scene, JointScene)
    gaps = np.random.default_rng(1).uniform(0.3, 0.9, (2, 45))
    np.save(tmp_path / "gaps.npy", gaps)
    cases = measured_gaps(scene, tmp_path / "gaps.npy")
    for k, row in enumerate(gaps):
        wanted = load_case(with_gap(scene, row))
        np.testing.assert_allclose(cases.load(k).g, wanted.g, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(cases.load(k).f, wanted.f)
    assert abs(cases.load(0).g - gaps[0]).max() > 0.1


def test_the_first_gap_among_the_cases_that_is_no_number_is_named(scene: Scene, tmp_path: Path) -> None:
    path, gaps = tmp_path / "gaps.npy", np.full((500, M), 0.1)
    gaps[412, 7] = gaps[412, 9] = np.nan
    gaps[499, 0] = np.inf
    np.save(path, gaps)
    said = "gaps.npy: case 412, contact 7 = nan: every gap must be a finite number, in mm; 1 more"
    assert said in str(refusal_of(measured_gaps, scene, path))
    assert measured_gaps(scene, path, 412).count == 412


def test_a_mapped_table_is_never_in_memory_as_a_whole(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, gaps = tmp_path / "gaps.npy", np.full((10_000, M), 0.1)
    np.save(path, gaps)
    monkeypatch.setattr("problems.load_cases.measured_gaps.AT_ONCE", 2**13)
    monkeypatch.setattr("problems.load_cases.measured_gaps.outliers", lambda gaps, near: gaps > 1)
    key = measured_gaps(scene, path).content_key
    tracemalloc.start()
    try:
        assert measured_gaps(scene, path).content_key == key
        assert tracemalloc.get_traced_memory()[1] < gaps.nbytes / 10
    finally:
        tracemalloc.stop()
    gaps[-1, 0] = 0.2
    np.save(path, gaps)
    assert measured_gaps(scene, path).content_key != key


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,2,3\n4,5,6\n", r"shape = \(2, 3\).*45 contacts"),
        ("1,2\n1,2,3\n", "line 2"),
        ("", "shape = \\(0, 0\\)"),
        (",".join(["x"] * 45) + "\n", r"shape = \(0, 0\)"),  # a header without a case
        (",".join(["1.5"] + ["x"] * 44) + "\n", "line 1 .* a finite number"),
    ],
)
def test_a_csv_that_is_no_table(text: str, words: str, scene: Scene, tmp_path: Path) -> None:
    (tmp_path / "gaps.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        measured_gaps(scene, tmp_path / "gaps.csv")


@pytest.mark.parametrize("name", ["gaps.csv", "gaps.npz", "gaps.npy", "gaps.txt"])
def test_a_table_that_cannot_be_read(name: str, scene: Scene, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=name):
        measured_gaps(scene, tmp_path / name)
    np.savez(tmp_path / "two.npz", a=np.zeros(3), b=np.zeros(3))
    with pytest.raises(InputError, match=r"two\.npz: arrays = \['a', 'b'\]: gaps, or one array alone"):
        measured_gaps(scene, tmp_path / "two.npz")


def test_a_sweep_is_the_scene_with_its_keys_changed(scene: Scene, tmp_path: Path) -> None:
    cases = sweep(scene, ["initial_gap.random.sd=0.1,0.3", "fasteners.preload = 50:150:3 "])
    assert cases.count == 6
    assert [cases.parameters(k)["fasteners.preload"] for k in range(6)] == [50, 100, 150] * 2
    for k in (0, 5):
        sd, preload = cases.parameters(k).values()
        changes = (("sd = 0.2", f"sd = {sd}"), ("preload = 60.0", f"preload = {preload}"))
        wanted = load_case(read_scene(str(write_strip(tmp_path, *changes))))
        np.testing.assert_array_equal(cases.load(k).f, wanted.f)
        np.testing.assert_array_equal(cases.load(k).g, wanted.g)


def test_a_comma_between_digits_in_a_sweep_is_said_to_make_two_values(scene: Scene) -> None:
    cases = sweep(scene, ["fasteners.preload = 50,5 "])
    assert cases.notes == ("--sweep fasteners.preload has two values, 50,5: decimals have a point",)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("fasteners.preload", "KIND.KEY=FIRST:LAST:COUNT"),
        ("fasteners.preload=1:2:0", "KIND.KEY=FIRST:LAST:COUNT"),
        ("fasteners.preload=1,nan", "KIND.KEY=FIRST:LAST:COUNT"),
        ("fasteners.load=1:2:3", "one of initial_gap.mean, initial_gap.random.sd, .*fasteners.preload"),
        ("ribs.I=1:2:3", "what changes K"),
        ("fasteners.preload=-1:1:3", "greater than 0"),
    ],
)
def test_a_bad_sweep(text: str, words: str, scene: Scene) -> None:
    with pytest.raises(InputError, match=words):
        sweep(scene, [text])


def test_points_of_a_sweep_are_checked_in_all_combinations(tmp_path: Path) -> None:
    """Each key alone is on the part, both are in its bay, or beyond the junction."""
    own = scene_from(with_bay(tmp_path), {"kind": "fasteners", "preload": 1.0, "points": [[10.0, 10.0]]})
    one = Fasteners.model_validate(
        {"kind": "fasteners", "preload": 1.0, "pattern": {"columns": 1, "rows": 1}}
    )
    for scene, texts, where, found in (
        (own, ("points.x=0,40", "points.y=0,60"), "points.x at 40, fasteners.points.y at 60", [50.0, 70.0]),
        (
            make_scene(JOINT, one),
            ("pattern.columns=1,4", "pattern.edge=0,500"),
            "pattern.columns at 4, fasteners.pattern.edge at 500",
            500.0,
        ),
    ):
        sweeps = [f"fasteners.{text}" for text in texts]
        assert [sweep(scene, [text]).count for text in sweeps] == [2, 2]
        faults = [(fault.where, fault.value) for fault in refusal_of(sweep, scene, sweeps).faults]
        assert faults == [(f"--sweep fasteners.{where}", found)]


def test_points_of_a_sweep_are_checked_beside_other_effects() -> None:
    scene = make_scene(
        JOINT,
        Fasteners(kind="fasteners", preload=1.0, points=((100.0, 60.0),)),
        InstalledFasteners(kind="installed_fasteners", points=((150.0, 60.0),)),
    )
    assert sweep(scene, ["fasteners.points.x=0:40:5"]).count == 5
    with pytest.raises(InputError, match=r"--sweep fasteners.points.x at 50: installed_fasteners.points = "):
        sweep(scene, ["fasteners.points.x=0:50:6"])
    assert keys_of(scene)["fasteners.points.x"].faults(scene, 50.0, "--find")


def test_a_key_swept_twice_and_two_effects_of_a_kind(tmp_path: Path) -> None:
    more = '[[effect]]\nkind = "pressure"\npart = "a"\nvalue = 2e-4\n[[effect]]\nkind = "ribs"'
    scene = read_scene(str(write_strip(tmp_path, ('[[effect]]\nkind = "ribs"', more))))
    with pytest.raises(InputError, match="swept twice"):
        sweep(scene, ["pressure.1.value=1,2", "pressure.1.value=3"])
    first, second = (
        sweep(scene, [f"pressure.{text}"]) for text in ("0.value=1e-4,2e-4", "1.value=2e-4,4e-4")
    )
    np.testing.assert_array_equal(first.load(0).f, load_case(scene).f)
    moved, twice = (cases.load(1).f - cases.load(0).f for cases in (first, second))
    assert abs(moved).max() > 0
    np.testing.assert_allclose(twice, 2 * moved, atol=1e-12)
