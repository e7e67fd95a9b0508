"""Unusual assemblies: stiff parts, stacks, a rigid tool, and the smallest possible problems."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import LoadCase
from problems.manufactured.exact import Shares, exact_model, manufacture, spectrum
from problems.manufactured.ladder import Ladder, ManufacturedProblem, Rung, plates

JUNCTION = {"length": 1000.0, "width": 300.0, "nodes": (12, 5)}
CLAMPED_PART = {"thickness": 6.0, "north": {"length": 300.0, "elements": 4}, "clamped": ("north",)}
GAP = {"kind": "initial_gap", "mean": 0.3, "random": {"sd": 0.1, "correlation_length": 150.0, "seed": 1}}
FASTENERS = {"kind": "fasteners", "preload": 1000.0, "pattern": {"columns": 4, "rows": 2, "edge": 50.0}}


def _joint(*parts: dict[str, Any], **more: Any) -> dict[str, Any]:
    named = [{"name": f"part {k + 1}"} | CLAMPED_PART | part for k, part in enumerate(parts)]
    return {"junction": JUNCTION, "part": named, **more}


def _stack(count: int) -> Rung:
    return plates(f"A stack of {count} parts", _joint(*[{}] * count), GAP, FASTENERS)


def _stiff() -> Rung:
    joint = _joint({}, {"young": 70e6})
    return plates("A part a thousand times as stiff as the other", joint, GAP, FASTENERS)


def _tool() -> Rung:
    joint = _joint({}, contacts=(("part 1", "tool"),))
    return plates("A part against a rigid tool", joint, GAP, FASTENERS)


def _between() -> Rung:
    joint = _joint({}, {}, contacts=(("part 1", "part 2"), ("part 2", "tool")))
    return plates("Two parts on a rigid tool", joint, GAP, FASTENERS)


def _one_node() -> Rung:
    one = exact_model(np.ones(1), A=sp.csc_array([[1.0]]))
    return Rung(
        "One node against a rigid tool",
        made=ManufacturedProblem(one.assembly(), LoadCase(np.ones(1), np.zeros(1))),
    )


def _two_nodes() -> Rung:
    made = manufacture(exact_model(np.ones(1), np.ones(1)), seed=10, shares=Shares(1.0))
    return Rung("Two parts of one node", made=made)


def _one_contact() -> Rung:
    d, normal = spectrum(64, 1e6), np.zeros((128, 1))
    normal[[0, 64]] = [[1.0], [-1.0]]
    made = manufacture(exact_model(d, d, A=sp.csc_array(normal)), seed=11, shares=Shares(1.0))
    return Rung("Two parts of 64 nodes, one contact", made=made)


def _many_contacts() -> Rung:
    """Twelve contacts on eight unknowns: x is unique, the forces are not, and Q is singular."""
    random = np.random.default_rng(12)
    A = sp.csc_array(np.hstack([np.eye(8), random.choice([-1.0, 1.0], (8, 4))]))
    d = spectrum(8, 1e3)
    made = ManufacturedProblem(exact_model(d, A=A).assembly(), LoadCase(np.ones(8), np.zeros(12)))
    return Rung("More contacts than unknowns", made=made, refused="must not depend on the columns before it")


RUNGS: Ladder = {
    "one-node": _one_node,
    "two-nodes": _two_nodes,
    "one-contact": _one_contact,
    "tool": _tool,
    "two-and-tool": _between,
    "three": lambda: _stack(3),
    "five": lambda: _stack(5),
    "stiff": _stiff,
    "more-contacts-than-unknowns": _many_contacts,
}
