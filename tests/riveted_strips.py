"""Two strips that stages press together, rivet and let go: a joint without contact, in closed form."""

from typing import Any

from harness.scene.solution import Solution
from problems.model.scene import JointScene
from problems.scene_files import scene_of

Tables = dict[str, Any]
LENGTH, THICKNESS, WIDTH, YOUNG = 200.0, 4.0, 10.0, 70e3
#: Relative deflection of the middles of two built-in strips per force between them, mm/N.
C = 2 * LENGTH**3 / (192 * YOUNG * WIDTH * THICKNESS**3 / 12)
FORCE, STIFFNESS = 30.0, 900.0


def strips(**rivets: Any) -> JointScene:
    """Two strips built in at both ends, pressed together at the middle, and riveted where they are."""
    ends = {"length": (LENGTH - 20) / 2, "elements": 3}
    strip = {"thickness": THICKNESS, "young": YOUNG, "poisson": 0.0, "clamped": ["south", "north"]}
    parts = [strip | {"name": name, "south": ends, "north": ends} for name in "ab"]
    junction = {"length": WIDTH, "width": 20.0, "nodes": [2, 3]}
    forces = {"points": [[0.0, 10.0], [WIDTH, 10.0]], "preload": FORCE / 2}
    rivet = {"points": forces["points"], "stiffness": STIFFNESS / 2}
    effects = [
        {"kind": "initial_gap", "mean": 50.0},
        {"kind": "fasteners", "name": "tacks"} | forces,
        {"kind": "installed_fasteners", "name": "rivets"} | rivet | rivets,
    ]
    stages = [
        {"name": "tack", "on": ["tacks"]},
        {"name": "rivet", "on": ["rivets"]},
        {"name": "release", "off": ["tacks"]},
    ]
    return joint_scene({"joint": {"junction": junction, "part": parts}, "effect": effects, "stage": stages})


def joint_scene(table: Tables) -> JointScene:
    scene = scene_of(table)
    assert isinstance(scene, JointScene)
    return scene


def approach(answer: Solution, stage: int) -> float:
    """By how much the gaps at the middle of the strips have been closed, on average."""
    return float((50.0 - answer.stages[stage].gap[2:4]).mean())
