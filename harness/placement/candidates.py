"""The holes that fasteners may go into, and the scene without its fasteners."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from problems.effects.fasteners import Fasteners
from problems.errors import Fault, InputError
from problems.forms.assembly import Matrix
from problems.input.scan_points import crowded
from problems.input.tables import read_columns
from problems.model.effect import SpringEffect
from problems.model.interface import on_junction
from problems.model.positions import MOST
from problems.model.scene import JointScene, Scene

Place = tuple[float, float]  # mm
Plan = tuple[Place, ...]  # sorted

ROWS_AND_COLUMNS = re.compile(r"(\d{0,9})x(\d{0,9})")
ROWS = range(1, 5)  # of uniform plans
DIGITS = 6  # of a place in mm: to the nanometre


@dataclass(frozen=True)
class Movable:
    """bare : the scene without its fasteners. fastener : one of them, for its preload and contact. own : the
    places where the scene has them.
    """

    bare: JointScene
    fastener: Fasteners
    own: Plan

    @classmethod
    def of(cls, scene: Scene) -> Movable:
        """Raises InputError as `movable_fasteners` does, and if two are at one place."""
        found = movable_fasteners(scene)
        assert isinstance(scene, JointScene)
        others = tuple(effect for effect in scene.effects if effect not in found)
        marks = np.concatenate([each.marks(scene.joint) for each in found])
        if twice := _twice(marks, f"scene {scene.name}"):
            raise InputError(twice)
        return cls(replace(scene, effects=others), found[0], plan_of(marks))

    def candidates(self, asked: str | None) -> Plan:
        """The places of a pattern `4x32`, rows × columns of the junction's cells, of a CSV with columns x and
        y, or by default those of the scene. Raises InputError if one is off the parts, or there twice.
        """
        if asked is None:
            return self.own
        if pattern := ROWS_AND_COLUMNS.fullmatch(asked):
            rows, columns = (int(each or 0) for each in pattern.groups())
            if not 0 < rows * columns <= MOST:
                allowed = f"rows x columns, 1 to {MOST} holes, or a CSV file"
                raise InputError.one("--candidates", "holes", asked, allowed)
            points, faults = grid(self.bare, rows, columns), []
        else:
            read = read_columns(Path(asked), {"x": "x", "y": "y"})
            points, faults = np.array(read.rows).reshape(-1, 2), read.faults
        faults = faults + self.faults(points, asked)
        if faults:
            raise InputError(faults)
        return plan_of(points)

    def faults(self, points: Matrix, source: str) -> list[Fault]:
        """Of points off the parts, there twice, or where a fastener is installed."""
        joint = self.bare.joint
        on = joint.covers(self.fastener.parts(joint), points)
        found = [Fault(source, "x, y", points[k].tolist(), on_junction(joint)) for k in np.flatnonzero(~on)]
        placed = self.fastener.model_copy(update={"points": tuple(map(tuple, points)), "pattern": None})
        for installed in self.bare.effects_of(SpringEffect):
            found += [Fault(source, *fault) for fault in installed.faults(joint, [placed])]
        return found + _twice(points, source)


def movable_fasteners(scene: Scene) -> list[Fasteners]:
    """The fasteners with a preload. Raises InputError if there are none, or if they are unlike."""
    where = f"scene {scene.name}"
    if not isinstance(scene, JointScene):
        raise InputError.one(where, "assembly", "own matrices", "fasteners move on a joint only")
    found = list(scene.effects_of(Fasteners))
    if not found:
        allowed = 'an [[effect]] kind = "fasteners": its preload is that of each one'
        raise InputError.one(where, "effect", "no fasteners", allowed)
    for name in ("preload", "between"):
        values = [getattr(each, name) for each in found]
        if any(value != values[0] for value in values):
            raise InputError.one(where, f"fasteners.{name}", values, "the same in all: they change places")
    return found


def _twice(points: Matrix, source: str) -> list[Fault]:
    return [Fault(source, "x, y", points[k].tolist(), "is there twice") for _, k in crowded(points)]


def plan_of(points: Matrix) -> Plan:
    return tuple(sorted({(x, y) for x, y in points.round(DIGITS).tolist()}))


def uniform_plans(bare: JointScene, count: int) -> list[Plan]:
    """Of so many fasteners, in rows that differ by one at most: at the middles of equal cells."""
    plans = []
    for rows in ROWS[:count]:
        columns = [count // rows + (row < count % rows) for row in range(rows)]
        lines = [grid(bare, rows, c).reshape(rows, c, 2)[row] for row, c in enumerate(columns)]
        plans.append(plan_of(np.vstack(lines)))
    return plans


def grid(scene: JointScene, rows: int, columns: int) -> Matrix:
    """(rows columns, 2) the middles of equal cells of the junction."""
    low, high = scene.joint.bounds
    x, y = (
        start + (np.arange(count) + 0.5) * (stop - start) / count
        for start, stop, count in zip(low, high, (columns, rows), strict=True)
    )
    return np.column_stack([each.ravel() for each in np.meshgrid(x, y)])
