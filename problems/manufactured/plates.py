"""Rungs of plates with a gap and fasteners: parts on a junction of 1 m, or the packaged wing panel."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from problems.model.effect import effect_class
from problems.model.joint import Joint
from problems.model.scene import JointScene

Tables = dict[str, Any]  # as in the file of a scene

ASSEMBLIES = Path(__file__).resolve().parents[1] / "assemblies"
FREE: Tables = {"thickness": 6.0}
CLAMPED = FREE | {"north": {"length": 300.0, "elements": 4}, "clamped": ("north",)}


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
    joint = {"junction": junction, "part": named, "contacts": contacts}
    return _scene(title, joint, *effects, *_loads(0.3, 0.1, columns=4, rows=2, edge=50.0), refused=refused)


def wing_panel(title: str, n: int, thicker: float = 1.0, **supports: float) -> JointScene:
    """The packaged assembly with n unknowns: its fragment so much thicker, its supports with other values."""
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
