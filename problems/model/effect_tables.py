"""Reads the [[effect]] tables of a scene, with the CSV files that they name, into effects."""

import importlib
import pkgutil
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Self

from pydantic import ValidationError

from problems.errors import Fault
from problems.input.bounded_types import unknown, validation_faults
from problems.input.tables import Rows, TableOptions, heading, parameter, read_columns

from .effect import Effect, unknown_part
from .interface import AnyJoint
from .joint import Faults

#: The keys that say how the CSV of the key `file` is read, and their defaults.
FILE_KEYS: dict[str, Any] = {"columns": {}, "skip_lines": 0, "missing": []}
#: Effects that a user may look for, by the assumption of the model that excludes them.
EXCLUDED = {
    "assumption 2: fasteners hold the parts tangentially, only normal displacements remain": "tangential "
    "sliding",
    "assumption 4: friction between the parts is neglected": "friction",
    "assumption 5: linear elasticity": "large_displacement large_rotation plasticity creep",
    "the answer is the minimum of a static energy, without inertia or time": "dynamics vibration impact",
}


@dataclass
class EffectTable:
    """An [[effect]] table at a place in a file, the effect made of it, and the rows of its CSV file.

    effect : None if the table is invalid. If the CSV has bad rows, the effect is made of the good ones, so
    that these and the other parameters are still checked. of_points : the lines and the stages of its points
    in their file.
    """

    where: Path
    index: int
    content: dict[str, Any]
    effect: Effect | None = None
    rows: Rows | None = None
    of_points: tuple[tuple[str, ...], tuple[str, ...]] = (), ()

    @classmethod
    def of(cls, where: Path, index: int, table: dict[str, Any] | Effect) -> Self:
        """The table, or that of an effect."""
        if not isinstance(table, Effect):
            return cls(where, index, table)
        of_points = table._lines, table._stages
        return cls(where, index, table.model_dump(exclude_unset=True), of_points=of_points)

    def read(self) -> Iterator[Fault]:
        """Make the effect; yield the faults that the table has without regard to the joint."""
        kind = self.content.get("kind")
        if kind not in effect_kinds():
            allowed = unknown("effect", kind, effect_kinds())
            for why, names in EXCLUDED.items():
                for name in get_close_matches(str(kind).lower(), names.split(), 1, 0.75):
                    allowed = f"the model excludes {name} ({why}); {allowed}"
            yield Fault(str(self.where), f"effect[{self.index}].kind", kind, allowed)
            return
        effect, content = effect_class(kind), self.content
        if effect.columns and "file" in content:
            if wrong := list(self._located(self._wrong_keys(effect))):
                yield from wrong
                return
            names, skip, missing = (content.get(key, value) for key, value in FILE_KEYS.items())
            wanted = (*effect.columns, *(name for name in effect.more_columns if name in names))
            options = TableOptions(tuple(names.get(name, name) for name in wanted), tuple(missing), skip)
            optional = [name for name in effect.more_columns if name not in names]
            self.rows = read_columns(self.where.parent / str(content["file"]), wanted, options, optional)
            lines = tuple(f"{self.rows.path.name}, line {line}" for line in self.rows.lines)
            self.of_points = lines, tuple(self.rows.words["stage"])
            yield from self._unread(effect, options.columns)
            content = {key: value for key, value in content.items() if key not in (*FILE_KEYS, "file")}
            count = len(effect.columns)
            content["points"] = [row[:count] for row in self.rows.rows]
            for k, name in enumerate(self.rows.columns[count:], start=count):
                if name in content:
                    allowed = f"leave it out: {self.rows.path.name} has a column {name}"
                    yield from self._located(iter([(name, content[name], allowed)]))
                column = [row[k] for row in self.rows.rows]
                content[name] = column[0] if len(set(column)) == 1 else column
        try:
            self.effect = effect.model_validate(content)
            (lines, stages), count = self.of_points, len(getattr(self.effect, "points", ()))
            if len(lines) == count:
                self.effect._lines, self.effect._stages = lines, stages
            elif stages:
                allowed = f"{len(stages)} points: the column stage of its file has as many"
                yield from self._located(iter([("points", f"{count} points", allowed)]))
        except ValidationError as error:
            faults = validation_faults(self.where, effect, error, self._name)
            keys = ((fault.key.removeprefix(self._name).lstrip("."), fault) for fault in faults)
            yield from self._located((key, fault.value, fault.allowed) for key, fault in keys)
        yield from self.rows.faults if self.rows else ()

    def _wrong_keys(self, effect: type[Effect]) -> Faults:
        """Yield the keys that say wrongly how the file is read."""
        names, skip, missing = (self.content.get(key, value) for key, value in FILE_KEYS.items())
        if "points" in self.content:
            yield "file", self.content["file"], "give either points or file"
        are_headings = isinstance(names, dict) and all(isinstance(value, str) for value in names.values())
        if not (are_headings and set(names) <= {*effect.columns, *effect.more_columns}):
            allowed = f"headings of the file by name, as {{ {effect.columns[0]} = 'X [mm]' }}; names: "
            yield "columns", names, allowed + ", ".join((*effect.columns, *effect.more_columns))
        if type(skip) is not int or skip < 0:
            yield "skip_lines", skip, "a number of lines, 0 or more"
        if not isinstance(missing, list) or (missing and "gap" not in effect.columns):
            allowed = "of a measured_gap, a list of what marks a point without a gap, as [9999, 'NaN']"
            yield "missing", missing, allowed

    def _unread(self, effect: type[Effect], read: Sequence[str]) -> Iterator[Fault]:
        """Yield the headings of the file, but those read, that are parameters and no columns."""
        columns = (*effect.columns, *effect.more_columns)
        names = [name for name in effect.model_fields if name not in (*Effect.model_fields, *columns)]
        wanted = [heading(text)[0] for text in read]
        if self.rows is None:
            return
        for cell in self.rows.header:
            if (name := parameter(cell, names)) and heading(cell)[0] not in wanted:
                allowed = f"no column {name}: a file has {', '.join(columns)}; {name} is a key of the effect"
                yield Fault(str(self.rows.path), "header", cell, allowed)

    def unknown_stages(self, names: Sequence[str]) -> Iterator[Fault]:
        """Yield the rows of the file that name none of the stages."""
        words = enumerate(self.effect._stages if self.effect else ())
        faults = ((k, word, unknown("stage", word, names)) for k, word in words if word not in names)
        yield from self._located((f"points[{k}]", word, allowed) for k, word, allowed in faults)

    def faults(self, joint: AnyJoint, tables: Sequence["EffectTable"] | None) -> Iterator[Fault]:
        """Yield the faults with respect to the joint and to the effects of other tables that act with it."""
        if self.effect is not None:
            others = [one.effect for one in tables or () if one.effect is not None and one is not self]
            beside = () if tables is None else (others,)
            yield from self._located(self.effect.faults(joint, *beside))
        elif isinstance(part := self.content.get("part"), str):
            yield from self._located(unknown_part(part, joint))

    @property
    def _name(self) -> str:
        kind = self.content.get("kind")
        return f"effect[{self.index}]" + (f" ({kind})" if kind else "")

    def _located(self, faults: Faults) -> Iterator[Fault]:
        """Yield faults of keys with the place of each: the scene, or the line of a file's row."""
        for key, value, allowed in faults:
            names = "|".join(["points", *(self.rows.columns if self.rows else ())])
            row = re.fullmatch(rf"(?:{names})(?:\[(\d+)\]|\.(\d+)(?:\.\d+)?)", key)
            if self.rows and row:
                line = self.rows.lines[int(row[1] or row[2])]
                yield Fault(str(self.rows.path), f"line {line}", value, allowed)
            elif not (self.rows and self.rows.faults and key in ("", "points")):  # due to bad rows
                yield Fault(str(self.where), ".".join(filter(None, [self._name, key])), value, allowed)


def effect_kinds() -> list[str]:
    """All kinds: the names of the files of problems/effects."""
    package = importlib.import_module("problems.effects")
    return sorted(module.name for module in pkgutil.iter_modules(package.__path__))


def effect_class(kind: str) -> type[Effect]:
    """The class of a kind, imported on demand. Raises ModuleNotFoundError if there is no such kind."""
    module = importlib.import_module(f"problems.effects.{kind}")
    return getattr(module, kind.title().replace("_", ""))
