"""The holes that fasteners may go into, and the scene without its fasteners."""

import re
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path

import numpy as np

from problems.effects.fasteners import Fasteners
from problems.errors import Fault, InputError
from problems.forms.assembly import Mask, Matrix
from problems.input.scan_points import crowded
from problems.input.tables import AS_NAMED, TableOptions, read_columns
from problems.model.effect import SpringEffect
from problems.model.interface import on_junction
from problems.model.positions import MOST
from problems.model.scene import JointScene, Scene
from problems.model.stage_answers import stage_scenes
from problems.model.stages import SLICE

Place = tuple[float, float]  # mm
Plan = tuple[Place, ...]  # sorted
Names = dict[Place, str]

ROWS = range(1, 5)  # of uniform plans
DIGITS = 6  # of a place in mm: to the nanometre


@dataclass(frozen=True)
class MovableFasteners:
    """The scene and those of its fasteners that can move.

    scene : with its stages. bare : what else acts in the last one. fastener : one of them, for its preload
    and the parts that it joins. current : the places where the scene has them.
    """

    scene: JointScene
    bare: JointScene
    fastener: Fasteners
    current: Plan

    @classmethod
    def of(cls, scene: Scene) -> "MovableFasteners":
        """Raises InputError as `movable_fasteners` does, or if a stage has only some of them, or names them
        by their numbers.
        """
        fasteners = movable_fasteners(scene)
        assert isinstance(scene, JointScene)
        for name, last in stage_scenes(scene).items():
            if (acting := list(last.effects_of(Fasteners))) and acting != fasteners:
                allowed = f"all points at once; in stage {name} some act: they change places"
                raise InputError.one(f"scene {scene.name}", "fasteners", [fasteners[0].name], allowed)
        named = [one for stage in scene.stages for one in (*stage.on, *stage.off)]
        if parts := [one for one in named if (some := SLICE.fullmatch(one)) and some[1] == fasteners[0].name]:
            allowed = "its name alone: a plan may have another number of points"
            raise InputError.one(f"scene {scene.name}", "fasteners in stages", parts, allowed)
        marks = np.concatenate([each.marks(scene.joint) for each in fasteners])
        return cls(scene, without_fasteners(last), fasteners[0], plan_of(marks))

    def candidates(self, holes: str | None, options: TableOptions = AS_NAMED) -> tuple[Plan, Names]:
        """The holes that fasteners may go into, and their names if the CSV has a column `name`.

        holes : a pattern `4x32`, rows × columns of equal cells of the junction, of which those count whose
        middle is on the parts, or the path of a CSV with columns x and y, mm, with the headings of `options`;
        None: where the scene's fasteners are. Raises InputError if a hole of a CSV is off the parts, if there
        is none, or if one is there twice.
        """
        if holes is None:
            return self.current, {}
        if cells := cells_of(holes, "--candidates", "rows x columns", "holes", MOST):
            points = grid(self.bare, *cells).round(DIGITS)
            points, faults, labels = points[self._on_parts(points)], [], []
            if not len(points):
                allowed = "cells, at least one with its centre on the parts"
                raise InputError.one("--candidates", "holes", holes, allowed)
        else:
            table = read_columns(Path(holes), ("x", "y"), replace(options, missing=()))
            points, faults, labels = np.array(table.rows).reshape(-1, 2), table.faults, table.words["name"]
        points = points.round(DIGITS)  # as plans have them: rounding may leave the parts
        faults = faults + self.faults(points, holes)
        if faults:
            raise InputError(faults)
        return plan_of(points), dict(zip(map(tuple, points.tolist()), labels, strict=False))

    def faults(self, points: Matrix, source: str) -> list[Fault]:
        """One fault for each point off the parts, there twice, or where a fastener stays installed."""
        if not len(points):
            return []
        joint = self.bare.joint
        off = np.flatnonzero(~self._on_parts(points))
        faults = [Fault(source, "x, y", points[k].tolist(), on_junction(joint)) for k in off]
        placed = self.fastener.model_copy(update={"points": tuple(map(tuple, points)), "pattern": None})
        for installed in () if self.scene.stages else self.bare.effects_of(SpringEffect):
            faults += [Fault(source, *fault) for fault in installed.faults(joint, [placed])]
        twice = [points[k].tolist() for _, k in crowded(points)]
        return [*faults, *(Fault(source, "x, y", place, "is there twice") for place in twice)]

    def _on_parts(self, points: Matrix) -> Mask:
        joint = self.bare.joint
        return joint.covers(self.fastener.parts(joint), points)


def movable_fasteners(scene: Scene) -> list[Fasteners]:
    """The fasteners with a preload. Raises InputError if there are none, or if they are unlike."""
    where = f"scene {scene.name}"
    if not isinstance(scene, JointScene):
        raise InputError.one(where, "assembly", "own matrices", "fasteners move on a joint only")
    fasteners = list(scene.effects_of(Fasteners))
    if not fasteners:
        allowed = 'an [[effect]] kind = "fasteners", which alone move: its preload is that of each one'
        raise InputError.one(where, "effect", "no fasteners", allowed)
    for name in ("preload", "between"):
        values = [getattr(effect, name) for effect in fasteners]
        each = name == "preload" and any(isinstance(value, tuple) for value in values)
        if each or any(value != values[0] for value in values):
            raise InputError.one(where, f"fasteners.{name}", values, "the same in all: they change places")
    if scene.stages and (len(fasteners) > 1 or any(fasteners[0]._stages)):
        names = [effect.name for effect in fasteners]
        allowed = "one table, set by its name and not by a column stage: they change places"
        raise InputError.one(where, "fasteners in stages", names, allowed)
    return fasteners


def without_fasteners(scene: JointScene) -> JointScene:
    """The scene without the fasteners that can move."""
    others = [not isinstance(effect, Fasteners) for effect in scene.effects]
    effects, origin = compress(scene.effects, others), compress(scene.numbers, others)
    return replace(scene, effects=tuple(effects), origin=tuple(origin))


def plan_of(points: Matrix) -> Plan:
    return tuple(sorted({(x, y) for x, y in points.round(DIGITS).tolist()}))


def cells_of(text: str, option: str, order: str, items: str, most: int) -> tuple[int, int] | None:
    """Both numbers of a pattern as `4x32`; None of the path of a file. Raises InputError if there are more
    than `most` cells, or none.
    """
    if not (pattern := re.fullmatch(r"(\d{0,9})x(\d{0,9})", text)):
        return None
    first, second = (int(number or 0) for number in pattern.groups())
    if not 0 < first * second <= most:
        raise InputError.one(option, items, text, f"{order}, 1 to {most} {items}, or a CSV file")
    return first, second


def uniform_plans(bare: JointScene, count: int) -> list[Plan]:
    """Plans of `count` fasteners in 1 to 4 rows, at the middles of equal cells; the rows differ by one
    fastener at most.
    """
    plans = []
    for rows in ROWS[:count]:
        columns = [count // rows + (row < count % rows) for row in range(rows)]
        lines = [grid(bare, rows, c).reshape(rows, c, 2)[row] for row, c in enumerate(columns)]
        plans.append(plan_of(np.vstack(lines)))
    return plans


def grid(scene: JointScene, rows: int, columns: int) -> Matrix:
    """The middles (rows · columns, 2) of equal cells of the junction, mm."""
    low, high = scene.joint.bounds
    x, y = (
        start + (np.arange(count) + 0.5) * (stop - start) / count
        for start, stop, count in zip(low, high, (columns, rows), strict=True)
    )
    return np.column_stack([values.ravel() for values in np.meshgrid(x, y)])
