"""The wing panel on an ever thicker fragment: its stiffness, and with it cond(K), grows with its cube."""

from __future__ import annotations

import tomllib
from functools import partial
from pathlib import Path
from typing import Any

from problems.manufactured.ladder import Ladder, Rung, plates

ASSEMBLIES = Path(__file__).resolve().parents[2] / "assemblies"

GAP = {"kind": "initial_gap", "mean": 0.6, "random": {"sd": 0.2, "correlation_length": 150.0, "seed": 1}}
FASTENERS = {"kind": "fasteners", "preload": 1000.0, "pattern": {"columns": 16, "rows": 4, "edge": 25.0}}


def wing_fragment(n: int) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The tables of the packaged assembly with n unknowns: the joint, and the effects in it."""
    joint = tomllib.loads((ASSEMBLIES / f"wing-fragment-{n}.toml").read_text("utf-8"))
    return joint, joint.pop("effect")


def _rung(n: int, times: int) -> Rung:
    joint, effects = wing_fragment(n)
    wing, fragment = joint["part"]
    joint["part"] = [wing, fragment | {"thickness": times * fragment["thickness"]}]
    title = f"A wing panel of 6 mm on a fragment of {6 * times} mm, n = {n}"
    return plates(title, joint, *effects, GAP, FASTENERS)


RUNGS: Ladder = {
    f"{n}-{times:02d}": partial(_rung, n, times)
    for n, times in ((4386, 1), (4386, 4), (4386, 10), (4386, 30), (4386, 70), (11308, 30))
}
