"""Unusual assemblies.

parts      stiff parts, stacks, a rigid tool, and the smallest possible problems
floating   parts held by contact alone: K is singular, and the model refuses it
"""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy.sparse as sp

from problems.forms.assembly import LoadCase
from problems.forms.manufactured_problem import ManufacturedProblem
from problems.manufactured.exact import exact_assembly, manufacture, spectrum, two_parts
from problems.manufactured.ladder import Ladder, Scene, matrices

from .plates import CLAMPED, FREE, Tables, plates


def _stack(count: int) -> Tables:
    return {f"part {k + 1}": CLAMPED for k in range(count)}


def _singular() -> Scene:
    d = spectrum(16, 1e4)
    free = np.concatenate([[0.0], d[1:]])
    problem = ManufacturedProblem(exact_assembly(d, free), two_parts(16, 1e4, seed=13).load)
    return matrices("A part that can move without strain", problem, refused=INDEFINITE)


def _one_node() -> Scene:
    assembly = exact_assembly(np.ones(1), A=sp.csc_array([[1.0]]))
    problem = ManufacturedProblem(assembly, LoadCase(np.ones(1), np.zeros(1)))
    return matrices("One node against a rigid tool", problem)


def _one_contact() -> Scene:
    d, normal = spectrum(64, 1e6), np.zeros((128, 1))
    normal[[0, 64]] = [[1.0], [-1.0]]
    problem = manufacture(d, d, A=sp.csc_array(normal), seed=11, closed=1.0)
    return matrices("Two parts of 64 nodes, one contact", problem)


def _many_contacts() -> Scene:
    """Twelve contacts on eight unknowns: x is unique, the forces are not, and Q is singular."""
    random = np.random.default_rng(12)
    A = sp.csc_array(np.hstack([np.eye(8), random.choice([-1.0, 1.0], (8, 4))]))
    problem = ManufacturedProblem(exact_assembly(spectrum(8, 1e3), A=A), LoadCase(np.ones(8), np.zeros(12)))
    refused = "must not depend on the columns before it"
    return matrices("More contacts than unknowns", problem, refused=refused)


INDEFINITE = "K must be positive definite"
TOOL = ("part 1", "tool")
BETWEEN = (("part 1", "part 2"), ("part 2", "tool"))
STIFF = _stack(1) | {"part 2": CLAMPED | {"young": 70e6}}

_floating = partial(plates, refused=INDEFINITE)

RUNGS: dict[str, Ladder] = {
    "parts": {
        "one-node": _one_node,
        "two-nodes": lambda: matrices("Two parts of one node", two_parts(1, 1.0, seed=10, closed=1.0)),
        "one-contact": _one_contact,
        "tool": partial(plates, "A part against a rigid tool", _stack(1), contacts=(TOOL,)),
        "two-and-tool": partial(plates, "Two parts on a rigid tool", _stack(2), contacts=BETWEEN),
        "three": partial(plates, "A stack of 3 parts", _stack(3)),
        "five": partial(plates, "A stack of 5 parts", _stack(5)),
        "stiff": partial(plates, "A part a thousand times as stiff as the other", STIFF),
        "more-contacts-than-unknowns": _many_contacts,
    },
    "floating": {
        "on-a-part": partial(
            _floating, "A free plate against a clamped one", {"clamped": CLAMPED, "floating": FREE}
        ),
        "on-a-tool": partial(
            _floating,
            "A free plate against a rigid tool",
            {"floating": FREE},
            contacts=(("floating", "tool"),),
        ),
        "matrix": _singular,
    },
}
