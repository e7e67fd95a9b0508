"""Joints of superelements drawn at random, `drawn/superelements/<k>`: plates condensed onto drawn nodes.

Two or three plates lie over each other on a junction of aspect 1 … 8 with some 300 … 3000 contacts, or 1000
where rotations are kept. Each plate goes on beyond the junction and is built in there. In each cell of 3 × 3
nodes of its mesh one is kept: the middle one or a drawn one; at the border, one on the border. All parts keep
the same nodes, or each part has a mesh and nodes of its own.

Gap: mean 0.05 … 0.6 mm, standard deviation 0.005 … 0.1 mm, correlation length 60 … 400 mm. Fasteners: 2 … 16
columns, 1 … 3 rows, 20 … 1000 N each. Pressure on the outer parts: 10^−5 … 10^−1.5 MPa. Of the contacts few
close, or all.
"""

import itertools
from math import isqrt
from pathlib import Path
from typing import Any

import numpy as np

from problems.forms.assembly import Indices
from problems.model.condensed_plate import WITH_ROTATIONS, CondensedPlate
from problems.model.effect_tables import effect_class
from problems.model.joint import Joint, Junction, Part
from problems.model.scene import JointScene
from problems.model.superelement import Superelement
from problems.model.superelement_joint import PairingTable, SuperelementJoint
from problems.model.superelement_rows import NORMAL_ALONE

from .random_scenes import Draw, power_of_ten

NAMES = ("wing", "frame", "strap")
CLAMPED = (("south",), ("north",), ("south", "north"))
CELL = 3  # mesh nodes along each side of a cell, of which one node is kept
APART = 1.0  # mm, from one plate's nodes to the next one's
LONGEST = 25  # mm, of an element beyond the junction


def drawn_joint(name: str, draw: Draw) -> JointScene:
    """The scene of a name; its matrices are made when they are needed."""
    file = Path(name)
    names = NAMES[: draw(2, 3)]
    dofs = (NORMAL_ALONE, WITH_ROTATIONS)[draw(0, 1)]
    scattered, alike = draw(0, 1), draw(0, 1)
    count = draw(300, 1000 if dofs == WITH_ROTATIONS else 3000) // (len(names) - 1)
    rows = isqrt(count // draw(1, 8))
    columns, pitch = count // rows, draw(8, 20)
    length, width = float(pitch * (columns - 1)), float(pitch * (rows - 1))
    effects = _effects(draw, names, float(pitch))
    mesh, kept = _mesh(draw, columns, rows, scattered)
    parts: list[Superelement] = []
    for part in names:
        if parts and not alike:
            sizes = [max(size * draw(70, 130) // 100, CELL) for size in (columns, rows)]
            mesh, kept = _mesh(draw, sizes[0], sizes[1], scattered)
        junction = Junction(length=length, width=width, nodes=mesh)
        plate = CondensedPlate(Joint(junction=junction, part=(_plate(draw, part),)), kept, dofs)
        parts.append(plate.superelement(file, APART * len(parts)))
    joint = SuperelementJoint(tuple(parts), PairingTable().distance)
    nodes_are = f"{'the same' if alike else 'different'} {'scattered' if scattered else 'regular'} nodes"
    kept_are = "deflections and rotations" if dofs == WITH_ROTATIONS else "deflections"
    title = f"Drawn: {len(names)} superelements with {nodes_are}, {kept_are}"
    return JointScene(name, title, joint, effects)


def _effects(draw: Draw, names: tuple[str, ...], edge: float) -> tuple[Any, ...]:
    """Gap, fasteners and a pressure that presses the first part on the last."""
    random = {"sd": draw(5, 100) / 1000, "correlation_length": draw(60, 400), "seed": draw(0, 2**32 - 1)}
    pressure = power_of_ten(draw, -5000, -1500)
    pattern = {"columns": draw(2, 16), "rows": draw(1, 3), "edge": edge}
    tables: list[dict[str, Any]] = [
        {"kind": "initial_gap", "mean": draw(5, 60) / 100, "random": random},
        {"kind": "fasteners", "preload": draw(20, 1000), "pattern": pattern},
        {"kind": "pressure", "part": names[0], "value": pressure},
        {"kind": "pressure", "part": names[-1], "value": -pressure},
    ]
    return tuple(effect_class(table["kind"]).model_validate(table) for table in tables)


def _plate(draw: Draw, name: str) -> Part:
    clamped, beyond = CLAMPED[draw(0, 2)], draw(50, 300)
    extensions = {edge: {"length": beyond, "elements": -(-beyond // LONGEST)} for edge in clamped}
    table = {"name": name, "thickness": draw(10, 40) / 10, "clamped": clamped}
    return Part.model_validate(table | extensions)


def _mesh(draw: Draw, columns: int, rows: int, scattered: int) -> tuple[tuple[int, int], Indices]:
    """The mesh nodes along x and y, and those that are kept, x running fastest."""
    last = CELL - 1

    def place(cell: int, cells: int) -> int:
        inside = draw(0, last) if scattered else last // 2
        return CELL * cell + (0 if cell == 0 else last if cell == cells - 1 else inside)

    cells = itertools.product(range(rows), range(columns))
    kept = [place(row, rows) * CELL * columns + place(column, columns) for row, column in cells]
    return (CELL * columns, CELL * rows), np.array(kept)
