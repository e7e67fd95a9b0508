"""Small joints made in code, and the numbering of the plate's unknowns, written down once more."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from problems.effects.measured_gap import MeasuredGap
from problems.model.effect import Effect, SpringEffect
from problems.model.joint import Joint
from problems.model.scene import JointScene
from problems.scene_files import read_scene


def make_joint(*parts: dict[str, Any], contacts: Any = (), **junction: Any) -> Joint:
    data = {"length": 400.0, "width": 120.0, "nodes": (5, 4)} | junction
    part = [{"name": "a", "thickness": 6.0} | table for table in parts]
    given = {"contacts": contacts} if contacts else {}
    return Joint.model_validate({"junction": data, "part": part} | given)


#: Half of a joint, and a small joint of two of these.
PART = {"north": {"length": 90.0, "elements": 2}, "clamped": ["north"]}
JOINT = make_joint(PART, PART | {"name": "b"}, nodes=(9, 5))


def two_parts(
    length: float = 100.0, width: float = 50.0, nodes: tuple[int, int] = (4, 3), side: str = "north"
) -> str:
    """The table [joint] of parts a and b, 2 and 3 mm thick; `side` is where b goes on and is clamped."""
    return f"""
[joint]
junction = {{ length = {length}, width = {width}, nodes = {list(nodes)} }}
[[joint.part]]
name = "a"
thickness = 2.0
north = {{ length = 40.0, elements = 2 }}
clamped = ["north"]
[[joint.part]]
name = "b"
thickness = 3.0
{side} = {{ length = {40.0 if side == "north" else 60.0}, elements = 2 }}
clamped = ["{side}"]
"""


GAP = """
[[effect]]
kind = "initial_gap"
mean = 0.05
random = { sd = 0.02, correlation_length = 60.0, seed = 3 }
"""

FASTENERS = """
# Where they are now.
[[effect]]
kind = "fasteners"
preload = 40.0
points = [[20.0, 10.0], [50.0, 25.0], [80.0, 40.0]]
"""

#: Both as an array of inline tables, as tomli_w writes short ones; before the table [joint].
INLINE = """
effect = [
    { kind = "initial_gap", mean = 0.2 },
    { kind = "fasteners", preload = 40.0, points = [[20.0, 10.0], [50.0, 25.0], [80.0, 40.0]] },
]
"""

POINTS = "points = [[20.0, 10.0], [50.0, 25.0], [80.0, 40.0]]"
STAGED = f"""
title = "Tacked, shimmed, riveted, released"
{two_parts()}
{GAP}
[[effect]]
kind = "fasteners"
name = "tacks"
preload = 400.0
{POINTS}
[[effect]]
kind = "shims"
name = "shim"
thickness = 0.02
x = [0, 40]
y = [0, 50]
[[effect]]
kind = "installed_fasteners"
name = "rivets"
preload = 30.0
{POINTS}
[[effect]]
kind = "installed_fasteners"
stiffness = 5e3
approach = 0.03
points = [[10.0, 40.0]]
[[stage]]
name = "tack"
on = ["tacks"]
[[stage]]
name = "shim and rivet"
on = ["shim", "rivets[0:2]"]
[[stage]]
name = "rivet"
on = ["rivets[2:3]"]
[[stage]]
name = "release"
off = ["tacks"]
"""

SCENE = f"""
title = "TITLE"
{two_parts()}
[[effect]]
kind = "initial_gap"
mean = 0.1
[[effect]]
kind = "pressure"
part = "a"
value = 1e-3
"""


def make_scene(joint: Joint, *effects: Effect) -> JointScene:
    return JointScene("small", "small", joint, effects)


def scene_at(path: Path) -> JointScene:
    """The scene in a file."""
    scene = read_scene(str(path))
    assert isinstance(scene, JointScene)
    return scene


def forbid_building(monkeypatch: pytest.MonkeyPatch) -> None:
    """From here on every matrix has to come from the cache."""
    for stage in (
        "model.condensation.condense",
        "stiffness.dense_block.cholesky",
        "stiffness.dense_block.DenseBlock.compliance",
    ):
        monkeypatch.setattr(f"problems.{stage}", lambda *_: pytest.fail("built a second time"))


def with_gap(scene: JointScene, gap: Any) -> JointScene:
    """The scene with these gaps at its contacts, (m,) mm, in place of the random ones."""
    places = np.concatenate([scene.joint.places(pair) for pair in scene.joint.pairs])
    measured = MeasuredGap(kind="measured_gap", points=tuple(map(tuple, np.column_stack([places, gap]))))
    rest = (effect for effect in scene.effects if effect.kind != "initial_gap")
    return replace(scene, effects=(*rest, measured))


def untied(scene: JointScene) -> JointScene:
    """The scene without its springs between parts."""
    return replace(scene, effects=tuple(e for e in scene.effects if not isinstance(e, SpringEffect)))


def dof(nx: int, ix: int, iy: int, dx: int = 0, dy: int = 0) -> int:
    """The unknown of a grid point: deflection, or its derivative by x and y."""
    return ((2 * iy + dy) * nx + ix) * 2 + dx


def degrees(x: NDArray[np.float64], y: NDArray[np.float64], field: Any) -> NDArray[np.float64]:
    """The degrees of freedom of a field, field(x, y) → w, w_x, w_y, w_xy."""
    out = np.zeros(4 * len(x) * len(y))
    for iy, y_i in enumerate(y):
        for ix, x_i in enumerate(x):
            for value, (dx, dy) in zip(field(x_i, y_i), [(0, 0), (1, 0), (0, 1), (1, 1)], strict=True):
                out[dof(len(x), ix, iy, dx, dy)] = value
    return out
