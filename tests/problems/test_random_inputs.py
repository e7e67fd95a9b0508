"""Load cases with random keys: what a case is, on what it depends, its distributions, and bad inputs."""

import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal_of
from scipy import stats
from small_joints import JOINT, make_scene
from strip_scene import STRIP, write_strip
from superelements import scene_from, with_bay

from harness import validate
from harness.series.load_case_source import GapCases
from problems.build import load_case
from problems.effects.fasteners import Fasteners
from problems.effects.installed_fasteners import InstalledFasteners
from problems.errors import InputError
from problems.load_cases.random_inputs import RandomInputs
from problems.load_cases.sweep import keys_of, sweep
from problems.model.scene import JointScene, Scene
from problems.scene_files import read_scene

PRELOAD, PRESSURE = "fasteners.preload=normal(60, 5)", "pressure.value=uniform(1e-4, scale=1e-4)"
MEAN, SHIFT = "initial_gap.mean=norm(0.4, 0.01)", "fasteners.points.x=triang(0.5, -2, 4)"


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return read_scene(str(write_strip(tmp_path_factory.mktemp("strip"))))


def drawn(scene: Scene, *random: str, count: int | None = 20, **more: int) -> RandomInputs:
    cases = GapCases(count=count, random=random, **more).of(scene, "dual")
    assert isinstance(cases, RandomInputs)
    return cases


def test_a_case_is_the_scene_with_the_values_of_its_row(scene: Scene, tmp_path: Path) -> None:
    cases = drawn(scene, PRELOAD, PRESSURE, MEAN, SHIFT, seed=3)
    for k in (0, 13):
        row = cases.parameters(k)
        points = [[x + row["fasteners.points.x"], y] for x, y in ((50.0, 30.0), (200.0, 0.0), (350.0, 60.0))]
        written = write_strip(
            tmp_path,
            ("preload = 60.0", f"preload = {row['fasteners.preload']!r}"),
            ("value = 1e-4", f"value = {row['pressure.value']!r}"),
            ("mean = 0.4", f"mean = {row['initial_gap.mean']!r}"),
            ("seed = 7", f"seed = {row['gap_seed']}"),
            ("[[50.0, 30.0], [200.0, 0.0], [350.0, 60.0]]", str(points)),
        )
        wanted, load = load_case(read_scene(str(written))), cases.load(k)
        np.testing.assert_allclose(load.f, wanted.f, rtol=0, atol=1e-12)
        np.testing.assert_allclose(load.g, wanted.g, rtol=0, atol=1e-15)


def test_each_fastener_has_a_preload_of_its_own(scene: Scene) -> None:
    assert isinstance(scene, JointScene)
    cases = drawn(scene, f"{PRELOAD.replace('=', '=each ')}")
    numbers = cases.parameters(4)["fasteners.preload"]
    assert len(set(numbers)) == 3
    unit = [load_case(scene, "dual", [scene.effects[1].only([k], scene.joint)]).f / 60 for k in range(3)]
    others = load_case(scene, "dual", scene.effects[2:3]).f
    np.testing.assert_allclose(cases.load(4).f, others + numbers @ np.array(unit), rtol=0, atol=1e-12)
    assert drawn(scene, PRELOAD).load(4).f is not cases.load(4).f


def test_a_case_depends_on_seed_and_number_and_an_input_on_its_name(scene: Scene) -> None:
    few, many = drawn(scene, PRELOAD, PRESSURE, count=3), drawn(scene, PRESSURE, PRELOAD, MEAN, count=300)
    late = many.parameters(250)
    assert few.parameters(2).items() <= many.parameters(2).items()
    assert pickle.loads(pickle.dumps(many)).parameters(250) == late
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(many)).load(250).f, many.load(250).f)
    other = drawn(scene, PRELOAD, PRESSURE, count=3, seed=1)
    assert not set(other.parameters(2).values()) & set(few.parameters(2).values())
    assert len({few.key, other.key, many.key, drawn(scene, PRELOAD, count=3).key}) == 4
    assert drawn(scene, PRELOAD, PRESSURE, count=9).key == few.key


def test_without_a_random_gap_the_forces_alone_differ(tmp_path: Path) -> None:
    scene = read_scene(str(write_strip(tmp_path, ("random = {", "# random = {"))))
    cases = drawn(scene, PRELOAD)
    assert list(cases.parameters(0)) == ["fasteners.preload"]
    np.testing.assert_array_equal(cases.load(0).g, cases.load(1).g)
    gaps = drawn(scene, MEAN)
    assert gaps.load(0).f is gaps.load(1).f


@pytest.mark.parametrize(
    ("text", "law"),
    [
        ("normal(60, 5)", stats.norm(60, 5)),
        ("lognorm(s=0.1, scale=60)", stats.lognorm(0.1, 0, 60)),
        ("truncnorm(-2, 2, 60, 5)", stats.truncnorm(-2, 2, 60, 5)),
        ("each weibull_min(3, scale=60)", stats.weibull_min(3, 0, 60)),
    ],
)
def test_the_draws_have_the_distribution(scene: Scene, text: str, law: stats.rv_continuous) -> None:
    cases = drawn(scene, f"fasteners.preload={text}", count=600)
    numbers = np.array([cases.values(k)[0] for k in range(cases.count)])
    for column in numbers.T:
        assert stats.kstest(column, law.cdf).pvalue > 1e-3
    if numbers.shape[1] > 1:
        assert abs(np.corrcoef(numbers.T) - np.eye(3)).max() < 4 / np.sqrt(cases.count)


def test_the_median_of_each_input_is_said(scene: Scene) -> None:
    """It tells that a uniform distribution has a width, and no second end."""
    assert drawn(scene, PRELOAD, PRESSURE).notes == (
        "fasteners.preload: normal(60, 5), median 60",
        "pressure.value: uniform(1e-4, scale=1e-4), median 0.00015",
    )


def test_the_cases_of_contributors_exchange_one_input_at_a_time(scene: Scene) -> None:
    few, more = (drawn(scene, PRELOAD, PRESSURE, count=None, contributors=N) for N in (4, 8))
    assert (few.count, more.count) == (4 * 5, 8 * 5)
    assert few.key == more.key
    plain = drawn(scene, PRELOAD, PRESSURE)
    for j in range(4):
        A, B, *exchanged = (few.parameters(5 * j + r) for r in range(5))
        assert [plain.parameters(n) for n in (2 * j, 2 * j + 1)] == [A, B]
        for name, row in zip(("fasteners.preload", "pressure.value", "gap_seed"), exchanged, strict=True):
            assert row == A | {name: B[name]}
        assert more.parameters(5 * j + 3) == exchanged[1]


def test_a_sweep_shifts_all_points(scene: Scene, tmp_path: Path) -> None:
    moved = sweep(scene, ["fasteners.points.y=0,10"]).load(1)
    points = "[[50.0, 40.0], [200.0, 10.0], [350.0, 70.0]]"
    wanted = write_strip(tmp_path, ("[[50.0, 30.0], [200.0, 0.0], [350.0, 60.0]]", points))
    np.testing.assert_array_equal(moved.f, load_case(read_scene(str(wanted))).f)


def patterned(folder: Path, name: str = "", stages: str = "") -> Scene:
    pattern = f"{name}pattern = {{ columns = 3, rows = 2, edge = 20.0 }}"
    path = write_strip(folder, ("points = [[50.0, 30.0], [200.0, 0.0], [350.0, 60.0]]", pattern))
    path.write_text(path.read_text() + stages)
    return read_scene(str(path))


def test_a_shift_moves_the_points_of_the_pattern_that_is_drawn(tmp_path: Path) -> None:
    """Whatever the order of the keys."""
    scene, edge, shift = patterned(tmp_path), "fasteners.pattern.edge", "fasteners.points.x"
    assert isinstance(scene, JointScene)
    laws = f"{edge}=uniform(20, 10)", f"{shift}=uniform(-5, 10)"
    for cases in (drawn(scene, *laws), drawn(scene, *laws[::-1])):
        row, fasteners = cases.parameters(3), scene.effects[1]
        pattern = fasteners.pattern.model_copy(update={"edge": row[edge]})  # type: ignore[attr-defined]
        moved = np.array([row[shift], 0.0])
        marks = fasteners.model_copy(update={"pattern": pattern}).marks(scene.joint) + moved
        alone = fasteners.model_copy(update={"points": tuple(map(tuple, marks)), "pattern": None})
        wanted = load_case(scene, "dual", [alone, *scene.effects[2:]])
        np.testing.assert_allclose(cases.load(3).f, wanted.f, rtol=0, atol=1e-12)
    swept = sweep(scene, [f"{shift}=-5,5", f"{edge}=20,30"]), sweep(scene, [f"{edge}=20,30", f"{shift}=-5,5"])
    np.testing.assert_array_equal(swept[0].load(1).f, swept[1].load(2).f)
    assert abs(swept[0].load(1).f - swept[0].load(0).f).max() > 0.1


def test_a_pattern_whose_points_act_one_by_one_is_not_drawn(tmp_path: Path) -> None:
    law, told = "fasteners.pattern.edge=uniform(20, 10)", "fasteners.pattern.edge: key = 'fasteners.pattern"
    scene = patterned(tmp_path)
    for laws in ((law.replace("=", "=each "),), (law, "fasteners.points.x=each uniform(0, 1)")):
        with pytest.raises(InputError, match=f"--random {told}.*one by one"):
            drawn(scene, *laws)
    stages = '[[stage]]\nname = "1"\non = ["tacks[0:2]"]\n[[stage]]\nname = "2"\non = ["tacks[2:6]"]\n'
    with pytest.raises(InputError, match=f"--random {told}.*one by one"):
        drawn(patterned(tmp_path, 'name = "tacks"\n', stages), law)
    together = '[[stage]]\nname = "1"\non = ["tacks"]\n'
    assert drawn(patterned(tmp_path, 'name = "tacks"\n', together), law).count == 20


def test_a_truth_value_is_no_number_to_draw(tmp_path: Path) -> None:
    scene = patterned(tmp_path)
    assert isinstance(scene, JointScene)
    assert "fasteners.pattern.on_nodes" not in keys_of(scene)


BAD = [
    ("fasteners.preload=normal(60, 12)", "must be greater than 0"),  # its 1e-9 quantile is below 0
    ("fasteners.preload=normal(60, -5)", "a scale above 0"),
    ("fasteners.preload=lognorm()", "lognorm(s, loc=0, scale=1)"),
    ("fasteners.preload=norml(60, 5)", "did you mean norm"),
    ("fasteners.preload=binom(3, 0.5)", "no such distribution"),
    ("fasteners.preload=60", "[each] NAME(PARAMETERS)"),
    ("fasteners.preload=expon(loc=60, scale=1, scale=2)", "[each] NAME(PARAMETERS)"),
    ("fasteners.preload=0 of normal(60, 5)", "[each] NAME(PARAMETERS)"),
    (f"fasteners.preload={'9' * 5000} of normal(60, 5)", "[each] NAME(PARAMETERS)"),
    ("fasteners.points.x=normal(0, 20)", "on the junction"),
    ("fasteners.preload", "[each] NAME(PARAMETERS)"),
    ("pressure.value=each normal(0, 1)", "no elements at points"),
    ("ribs.I=normal(2e3, 1)", "what changes K would be another assembly"),
    ("initial_gap.random.seed=normal(7, 1)", "a valid integer"),
]


@pytest.mark.parametrize(("text", "allowed"), BAD)
def test_a_bad_input_is_told_what_is_allowed(scene: Scene, text: str, allowed: str) -> None:
    with pytest.raises(InputError, match=re.escape(allowed)):
        drawn(scene, text)


def test_keys_that_change_the_stiffness_are_refused_only_where_they_are_not_allowed(scene: Scene) -> None:
    said = []
    for stiffness in (False, True):
        with pytest.raises(InputError, match=r"fasteners\.preload") as error:
            GapCases(random=("ribs.K=normal(2e3, 1)",)).of(scene, "dual", stiffness=stiffness)
        said.append(str(error.value))
    assert ["another assembly" in text for text in said] == [True, False]
    assert ["ribs.I" in text for text in said] == [False, True]


def test_points_are_tried_between_the_ends_of_a_distribution(tmp_path: Path) -> None:
    """Both ends are on the part; between them is its bay, or an installed fastener."""
    fastener = {"kind": "fasteners", "preload": 1.0, "points": [[10.0, 60.0]]}
    with pytest.raises(InputError, match=r"uniform\(0, 80\) at .*: fasteners.points\[0\] = .* not in a bay"):
        drawn(scene_from(with_bay(tmp_path), fastener), "fasteners.points.x=uniform(0, 80)")
    near = Fasteners(kind="fasteners", preload=1.0, points=((100.0, 60.0), (90.0, 30.0)))
    installed = InstalledFasteners(kind="installed_fasteners", points=((150.0, 60.0),))
    law = "fasteners.points.x={}uniform(0, 100)"
    with pytest.raises(InputError, match=r"at 50: installed_fasteners\.points = .*separate places"):
        drawn(make_scene(JOINT, near, installed), law.format(""))
    assert drawn(make_scene(JOINT, near), law.format("each ")).load(3).f.any()


def test_a_draw_off_the_parts_names_keys_and_values(tmp_path: Path) -> None:
    """Each key alone is on the parts throughout."""
    fastener = {"kind": "fasteners", "preload": 1.0, "points": [[10.0, 10.0]]}
    laws = "fasteners.points.x=uniform(0, 40)", "fasteners.points.y=uniform(0, 60)"
    cases, counts = drawn(scene_from(with_bay(tmp_path), fastener), *laws), [0, 0]
    for k in range(cases.count):
        x, y = cases.parameters(k).values()
        if min(x, y) > 16:  # of its corner, the bay begins at 10, 10
            counts[0] += 1
            with pytest.raises(InputError, match=f"random .*points.x at {x:g}, .*y at {y:g}: .* a bay"):
                cases.load(k)
        elif min(x, y) < 10:
            counts[1] += 1
            assert cases.load(k).f.any()
    assert min(counts) > 2


def test_all_faults_are_told_at_once(scene: Scene) -> None:
    laws = PRELOAD, PRELOAD, "a=b", "fasteners.points.x=normal(0, -1)"
    keys = [fault.key for fault in refusal_of(drawn, scene, *laws, count=None, contributors=3).faults]
    assert keys == ["key", "key", "distribution", "distribution", "N, inputs"]


def test_more_contributors_than_cases_are_refused(scene: Scene) -> None:
    with pytest.raises(InputError, match="at most 10000000"):
        drawn(scene, PRELOAD, count=None, contributors=2**30)


def test_the_table_random_of_a_scene(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(f'{STRIP}\n[random]\nfasteners.preload = "normal(60, 5)"\n"pressure.value" = "norm()"\n')
    scene = read_scene(str(path))
    assert isinstance(scene, JointScene)
    assert scene.random == ("fasteners.preload=normal(60, 5)", "pressure.value=norm()")
    assert validate(path) is not None
    path.write_text(f'{STRIP}\n[random]\nfasteners.preload = "cauchy(60)"\npresure.value = "norm()"\n')
    with pytest.raises(InputError, match=r"scene: \[random\](.|\n)*preload = -(.|\n)*'presure.value'"):
        validate(path)
    path.write_text(f"{STRIP}\n[random]\nfasteners.preload = 5\n")
    with pytest.raises(InputError, match=r"random.fasteners.preload = 5"):
        read_scene(str(path))
    path.write_text(f"random = 5\n{STRIP}")
    with pytest.raises(InputError, match=r"random = 5"):
        read_scene(str(path))
