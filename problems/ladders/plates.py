"""Plates with a gap and fasteners, at full size the packaged wing panel.

refinement   two plates of fixed size with ever more nodes along x: cond(K) grows with the fourth power
supports     a clamped plate, and one on four ever softer springs; at full size the wing panel on ever softer
             supports. cond(K) grows with their compliance, at full size to 3e11: beyond, λmin(K) can no
             longer be proven there, so that no answer could be judged
thickness    two plates, the second ever thicker: its stiffness, and with it cond(K), grows with its cube
"""

import tomllib
from functools import partial
from pathlib import Path
from typing import Any

from problems.model.effect_tables import effect_class
from problems.model.joint import Joint
from problems.model.scene import JointScene

from . import Ladder, Scene

Tables = dict[str, Any]  # as in the file of a scene

ASSEMBLIES = Path(__file__).resolve().parents[1] / "assemblies"
FREE: Tables = {"thickness": 6.0}
CLAMPED = FREE | {"north": {"length": 300.0, "elements": 4}, "clamped": ("north",)}
POINTS = ((100.0, 0.0), (900.0, 0.0), (100.0, 300.0), (900.0, 300.0))


def plates(
    title: str,
    parts: Tables,
    *effects: Tables,
    contacts: tuple[tuple[str, str], ...] = (),
    nodes: tuple[int, int] = (12, 5),
    refused: str = "",
) -> JointScene:
    """Parts by name on a junction of 1 m × 0.3 m, with effects."""
    junction = {"length": 1000.0, "width": 300.0, "nodes": nodes}
    named = [{"name": name} | part for name, part in parts.items()]
    joint = {"junction": junction, "part": named} | ({"contacts": contacts} if contacts else {})
    return _scene(title, joint, *effects, *_loads(0.3, 0.1, columns=4, rows=2, edge=50.0), refused=refused)


def wing_panel(title: str, n: int, thicker: float = 1.0, **supports: float) -> JointScene:
    """The packaged assembly with n unknowns, its fragment `thicker` times as thick, its supports changed."""
    joint = tomllib.loads((ASSEMBLIES / f"wing-fragment-{n}.toml").read_text("utf-8"))
    effects = [table | (supports if table["kind"] == "supports" else {}) for table in joint.pop("effect")]
    joint["part"][1]["thickness"] *= thicker
    return _scene(title, joint, *effects, *_loads(0.6, 0.2, columns=16, rows=4, edge=25.0))


def _loads(mean: float, sd: float, **pattern: float) -> tuple[Tables, Tables]:
    """A random gap of this mean and standard deviation, mm, and fasteners of 1 kN in a pattern."""
    random = {"sd": sd, "correlation_length": 150.0, "seed": 1}
    gap = {"kind": "initial_gap", "mean": mean, "random": random}
    return gap, {"kind": "fasteners", "preload": 1000.0, "pattern": pattern}


def _scene(title: str, joint: Tables, *effects: Tables, refused: str = "") -> JointScene:
    checked = tuple(effect_class(table["kind"]).model_validate(table) for table in effects)
    return JointScene("", title, joint=Joint.model_validate(joint), effects=checked, refused=refused)


def _refined(nodes: int) -> Scene:
    parts = {"wing": CLAMPED, "fragment": CLAMPED}
    return plates(f"Two plates, {nodes} × 3 nodes", parts, nodes=(nodes, 3))


def _on_springs(stiffness: float) -> Scene:
    springs = {"kind": "supports", "part": "on springs", "points": POINTS, "stiffness_per_point": stiffness}
    parts = {"on springs": FREE, "clamped": CLAMPED}
    return plates(f"A plate on springs of {stiffness:g} N/mm", parts, springs)


def _panel_on_springs(n: int, stiffness: float) -> Scene:
    return wing_panel(f"A wing panel on supports of {stiffness:g} N/mm", n, stiffness_per_point=stiffness)


def _thicker(times: int) -> Scene:
    parts = {"thin": CLAMPED, "thick": CLAMPED | {"thickness": 6.0 * times}}
    return plates(f"A plate of 6 mm and one of {6 * times} mm", parts)


def _panel_on_thicker(n: int, times: int) -> Scene:
    return wing_panel(f"A wing panel of 6 mm on a fragment of {6 * times} mm", n, thicker=times)


RUNGS: dict[str, Ladder] = {
    "refinement": {f"{nodes:02d}": partial(_refined, nodes) for nodes in (8, 16, 32, 64)},
    "supports": {f"{k:.0e}": partial(_on_springs, k) for k in (1e6, 1e3, 1.0, 1e-2, 1e-4, 1e-6)},
    "thickness": {f"{times:03d}": partial(_thicker, times) for times in (1, 4, 10, 40, 100, 300)},
}
FULL_SIZE: dict[str, Ladder] = {
    "supports": {
        f"{n}-{k:.0e}": partial(_panel_on_springs, n, k)
        for n, k in ((4386, 1e3), (4386, 1.0), (4386, 1e-1), (4386, 1e-2), (4386, 2e-3), (11308, 1e-1))
    },
    "thickness": {
        f"{n}-{times:02d}": partial(_panel_on_thicker, n, times)
        for n, times in ((4386, 1), (4386, 4), (4386, 10), (4386, 30), (4386, 70), (11308, 30))
    },
}
