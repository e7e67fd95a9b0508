"""What may be, but is rarely meant, is said with the value and what is usual; nothing else is."""

from typing import Any

import pytest

from problems.random_scenes import EXAMPLES, SUPERELEMENTS
from problems.scene_files import read_scene, scene_names, scene_of

PART = {"name": "a", "thickness": 3.0, "north": {"length": 90.0, "elements": 2}, "clamped": ["north"]}
JOINT = {
    "junction": {"length": 400.0, "width": 120.0, "nodes": [9, 5]},
    "part": [PART, PART | {"name": "b", "thickness": 6.0}],
}

GALLERY = [name for name in scene_names() if name.startswith("gallery/")]
DRAWN = [name for name in EXAMPLES if SUPERELEMENTS not in name]  # those: test_random_superelements.py


def unusual(*effects: dict[str, Any], **joint: Any) -> list[str]:
    return scene_of({"joint": JOINT | joint, "effect": list(effects)}).unusual


FASTENER = {"kind": "fasteners", "preload": 3601.0, "points": [[200.0, 60.0]]}
CLAMP = {"kind": "clamps", "clamping_force": 10.0, "radius": 401.0, "points": [[200.0, 60.0]]}
WEIGHT = {"kind": "self_weight", "part": "a"}
TWICE = {"joint": JOINT, "effect": [WEIGHT, WEIGHT]}
SOFT = {"part": [PART | {"young": 70.0}, PART | {"name": "b", "young": 70e9}]}


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (lambda: unusual(junction={"length": 4.0, "width": 0.4, "nodes": [9, 5]}), ["length = 4", "metres"]),
        (
            lambda: unusual(junction={"length": 100.0, "width": 50.0, "nodes": [4, 1000]}),
            ["junction.nodes = [4, 1000]", "33.3 x 0.0501 mm"],
        ),
        (lambda: unusual(**SOFT), ["part.a.young = 70 ", "part.b.young = 7e+10"]),
        (lambda: unusual(part=[PART | {"thickness": 211.0}]), ["part.a.thickness = 211", "210 mm"]),
        (lambda: unusual({"kind": "initial_gap", "mean": -0.1}), ["initial_gap.mean = -0.1", "overlap"]),
        (
            lambda: unusual({"kind": "measured_gap", "points": [[0, 0, 1], [9, 0, -3], [0, 9, 0.5]]}),
            ["mean gap = -0.5"],
        ),
        (lambda: unusual(FASTENER), ["fasteners.preload = 3601", "3600 N on 3 mm"]),
        (lambda: unusual(CLAMP), ["clamps.radius = 401", "at most 400 mm"]),
        (lambda: unusual(WEIGHT, WEIGHT | {"name": "again"}), ["self_weight.table = that of an"]),
        (lambda: scene_of(TWICE | {"stage": [{"name": "rivet"}]}).unusual, ["self_weight.table = that"]),
    ],
)
def test_the_value_and_what_is_usual(found: Any, words: list[str]) -> None:
    said = " ".join(found())
    assert all(word in said for word in words), said


def test_what_is_usual_is_not_said() -> None:
    gap = {"kind": "initial_gap", "mean": 0.0}
    assert unusual(gap, FASTENER | {"preload": 3600.0}) == []


@pytest.mark.parametrize("name", [*GALLERY, *DRAWN])
def test_nothing_is_unusual_about_a_scene_of_the_gallery_or_a_drawn_one(name: str) -> None:
    assert read_scene(name).unusual == []
