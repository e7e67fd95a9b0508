"""Scenes drawn at random: the same wherever they are drawn, others for each version, within the ranges."""

import json
import math
from collections import Counter
from pathlib import Path

import pytest

import problems.random_scenes
from harness.planning.suite import read_suite, read_written, resolved_scenes, to_toml
from harness.results.schema import DRAWN
from problems.effects.initial_gap import RandomField
from problems.effects.pressure import Pressure
from problems.errors import Fault, InputError
from problems.model.positions import Pattern
from problems.model.scene import JointScene
from problems.random_scenes import KINDS, MEANS, ROWS, SIZES, drawn_names
from problems.scene_files import read_scene
from studies.publish import PUBLISHED

DRAWS = [f"{DRAWN}{n}/{k}" for k in range(80) for n in SIZES]  # 240


def drawn_scene(name: str) -> JointScene:
    scene = read_scene(name)
    assert isinstance(scene, JointScene)
    return scene


def parts_of(scene: JointScene) -> tuple[float, RandomField, float, Pattern, tuple[float, float]]:
    """Mean gap and its field, preload and its pattern, the pressures on the two parts."""
    gap, fasteners, *pressures = scene.effects[-4:]  # after those of the assembly
    assert gap.random is not None
    assert fasteners.pattern is not None
    wing, fragment = (effect for effect in pressures if isinstance(effect, Pressure))
    assert (wing.part, fragment.part) == ("wing", "fragment")
    return gap.mean, gap.random, fasteners.preload, fasteners.pattern, (wing.value, fragment.value)


def test_a_name_gives_the_same_scene_everywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """The digits are those of `printf 0.2.0/4386/7 | sha256sum`."""
    monkeypatch.setattr(problems.random_scenes, "__version__", "0.2.0")
    digits = "95027862 19d95e89 ed46722a 5f628451 bad6274f 1b458304 48266b9b 301c15a3"
    shares = [int(word, 16) / 2**32 for word in digits.split()]
    scene = drawn_scene("drawn/4386/7")
    mean, field, preload, pattern, pressures = parts_of(scene)
    assert mean == MEANS[math.floor(3 * shares[0])] == 0.6
    assert field.sd == (20 + math.floor(181 * shares[1])) / 1000 == 0.038
    assert field.correlation_length == 80 + math.floor(521 * shares[2]) == 562
    assert field.seed == int(digits.split()[3], 16)
    assert pattern == Pattern(columns=4 + math.floor(29 * shares[4]), rows=ROWS[0], edge=25.0)
    assert preload == 500 + math.floor(3501 * shares[6]) == 1486
    assert pressures == (5.176e-6, -5.176e-6)  # 10^(−5.286), as ⌊3801 · 0.18792…⌋ = 714
    assert scene.key == drawn_scene("drawn/4386/7").key
    assert scene.assembly_key == read_scene("4386/0107").assembly_key


def test_the_scenes_of_a_version_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their keys are those that version 0.3.0 published."""
    monkeypatch.setattr(problems.random_scenes, "__version__", "9.9.9")
    lines = (PUBLISHED / "speed" / "problems.jsonl").read_text("utf-8").splitlines()
    published = {row["scene"]: row["scene_key"] for row in map(json.loads, lines)}
    assert len(published) >= 9
    for name, key in published.items():
        drawn, _, version = name.partition("@")
        assert read_scene(f"{drawn}@{version or '0.3.0'}").key == key
        assert read_scene(drawn).key != key
    assert drawn_names("drawn/4386/1..2@0.3.0") == ["drawn/4386/1@0.3.0", "drawn/4386/2@0.3.0"]
    joint = "drawn/superelements/0"
    assert read_scene(f"{joint}@9.9.9").key == read_scene(joint).key != read_scene(f"{joint}@0.3.0").key


def test_every_parameter_is_within_its_range_and_fills_it() -> None:
    drawn = [(scene.key, *parts_of(scene)) for scene in map(drawn_scene, DRAWS)]
    keys, means, fields, preloads, patterns, pressures = zip(*drawn, strict=True)
    assert len(set(keys)) == len({field.seed for field in fields}) == len(DRAWS)
    for values, counts in ((MEANS, Counter(means)), (ROWS, Counter(p.rows for p in patterns))):
        assert set(counts) == set(values)
        assert min(counts.values()) > len(DRAWS) / 5
    assert {p.columns for p in patterns} == set(range(4, 33))
    assert all(first == -second for first, second in pressures)
    logarithms = [math.log10(first) for first, _ in pressures]
    for values, low, high in (
        ([field.sd for field in fields], 0.02, 0.2),
        ([field.correlation_length for field in fields], 80, 600),
        (preloads, 500, 4000),
        (logarithms, -6.0, -2.2),
    ):
        slack = 1e-4  # of a pressure of four digits
        assert low - slack <= min(values) < low + (high - low) / 50
        assert high - (high - low) / 50 < max(values) <= high + slack
        assert sum(values) / len(values) == pytest.approx((low + high) / 2, abs=(high - low) / 20)


@pytest.mark.parametrize(
    "name",
    ["drawn/4387/0", "drawn/4386/-1", "drawn/4386/01", "drawn/4386/100000", "drawn/4386/²"],
)
def test_any_other_name_is_an_unknown_scene(name: str) -> None:
    with pytest.raises(InputError, match=r"no such scene; similar: .*drawn/4386/0"):
        read_scene(name)


def test_a_range_stands_for_its_names() -> None:
    assert drawn_names("drawn/4386/8..11") == [f"drawn/4386/{k}" for k in (8, 9, 10, 11)]
    faults: list[Fault] = []
    for pattern in ("drawn/4386/3..2", "drawn/4386/0..", "drawn/1170/0..3", "drawn/4386/*"):
        resolved_scenes([pattern], "here", "scenes", Path(), faults)
    assert len(faults) == 4
    assert all("no such scene" in fault.allowed for fault in faults)
    assert not any(name.startswith(DRAWN) for name in resolved_scenes(["*"], "here", "scenes", Path(), []))


def test_the_suite_says_every_name_it_stands_for(tmp_path: Path) -> None:
    suite = read_suite("drawn")
    assert suite.scenes == [f"drawn/{kind}/{k}" for kind in KINDS for k in range(20)]
    (tmp_path / "suite.toml").write_text(to_toml(suite), "utf-8")
    assert read_written(tmp_path / "suite.toml") == suite
