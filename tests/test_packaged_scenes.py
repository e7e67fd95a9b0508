"""The scenes that come with the package."""

from __future__ import annotations

import pytest

from problems.scene import SCENES, read_scene, scene_names


@pytest.mark.parametrize("name", scene_names())
def test_every_scene_of_the_package_reads(name: str) -> None:
    scene = read_scene(name)
    n = int(name.split("/")[0])
    assert scene.name == name
    assert scene.expected_size == (n, n // 2)
    assert {type(effect).__name__ for effect in scene.effects} >= {"InitialGap", "Fasteners"}


def test_names_are_unique_and_the_smallest_problem_stands_first() -> None:
    names = scene_names()
    assert len(set(names)) == len(names) == len(list(SCENES.rglob("*.toml")))
    sizes = [int(name.split("/")[0]) for name in names]
    assert sizes == sorted(sizes)
    assert len({read_scene(name).key for name in names}) == len(names)


def test_a_scene_by_name_and_by_path_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(SCENES.parents[1])
    named = read_scene("4386/0107")
    assert read_scene("problems/scenes/4386/0107.toml") == named
    assert read_scene(str(SCENES / "4386" / "0107.toml")) == named


def test_scenes_of_one_size_share_their_matrices() -> None:
    keys = {name.split("/")[0]: set() for name in scene_names()}
    for name in scene_names():
        keys[name.split("/")[0]].add(read_scene(name).assembly_key)
    assert all(len(found) == 1 for found in keys.values())
    assert len(set.union(*keys.values())) == len(keys)
