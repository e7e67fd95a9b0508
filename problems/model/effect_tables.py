"""The [[effect]] tables of a scene and the CSV files that they name, read into effects; all their faults."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from problems.errors import Fault, InputError
from problems.input.bounded import regular_file, unknown, validation_faults

from .effect import EXCLUDED, Effect, effect_class, effect_kinds, unknown_part
from .interface import AnyJoint
from .joint import Faults

CSV_MIB = 100
UNIT = re.compile(r"[\s_]*(?:mm|\[\s*mm\s*\]|\(\s*mm\s*\))$", re.IGNORECASE)


@dataclass(frozen=True)
class Rows:
    """The good rows of a file, their line numbers, and the faults."""

    path: Path
    rows: list[tuple[float, ...]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)


@dataclass
class EffectTable:
    """A table, its file and index, its effect (None if invalid), and the rows of the file that it names.

    If that has bad rows, the effect is made of the good ones, so that these and the other parameters are
    still checked.
    """

    where: Path
    index: int
    content: dict[str, Any]
    effect: Effect | None = None
    rows: Rows | None = None

    def read(self) -> Iterator[Fault]:
        """Make the effect; yields the faults of the table by itself."""
        kind = self.content.get("kind")
        if kind not in effect_kinds():
            allowed = unknown("effect", kind, effect_kinds())
            for excluded in get_close_matches(str(kind).lower(), EXCLUDED, 1, 0.75):
                allowed = f"the model excludes {excluded} ({EXCLUDED[excluded]}); {allowed}"
            yield Fault(str(self.where), f"effect[{self.index}].kind", kind, allowed)
            return
        effect, content = effect_class(kind), self.content
        if effect.columns and "file" in content:
            if "points" in content:
                yield Fault(
                    str(self.where), f"{self._name}.file", content["file"], "give either points or file"
                )
                return
            headings = content.get("columns", {})
            named = isinstance(headings, dict) and all(isinstance(value, str) for value in headings.values())
            if not (named and set(headings) <= set(effect.columns)):
                allowed = f"headings of the file by name, as {{ {effect.columns[0]} = 'X [mm]' }}; names: "
                allowed += ", ".join(effect.columns)
                yield Fault(str(self.where), f"{self._name}.columns", headings, allowed)
                return
            path = self.where.parent / str(content["file"])
            self.rows = read_columns(path, {name: headings.get(name, name) for name in effect.columns})
            content = {key: value for key, value in content.items() if key not in ("file", "columns")}
            content["points"] = self.rows.rows
        try:
            self.effect = effect.model_validate(content)
        except ValidationError as error:
            for fault in validation_faults(self.where, effect, error, self._name):
                if not self._is_consequence(fault.key.removeprefix(self._name).lstrip(".")):
                    yield fault
        yield from self.rows.faults if self.rows else ()

    def misfits(self, joint: AnyJoint, tables: Sequence[EffectTable]) -> Iterator[Fault]:
        """The faults with respect to the joint and to the effects of the other tables."""
        found: Faults = iter(())
        if self.effect is not None:
            others = [table.effect for table in tables if table.effect is not None and table is not self]
            found = self.effect.faults(joint, others)
        elif isinstance(part := self.content.get("part"), str):
            found = unknown_part(part, joint)
        yield from self._faults(found)

    @property
    def _name(self) -> str:
        kind = self.content.get("kind")
        return f"effect[{self.index}]" + (f" ({kind})" if kind else "")

    def _faults(self, found: Faults) -> Iterator[Fault]:
        """The faults of parameters; those of a file's rows are located by line."""
        for key, value, allowed in found:
            row = re.fullmatch(r"points\[(\d+)\]", key)
            if self.rows and row:
                yield Fault(str(self.rows.path), f"line {self.rows.lines[int(row[1])]}", value, allowed)
            elif not self._is_consequence(key):
                yield Fault(str(self.where), f"{self._name}.{key}", value, allowed)

    def _is_consequence(self, key: str) -> bool:
        """Whether a fault of all points, or of the whole table, may result from bad rows of a file."""
        return bool(self.rows and self.rows.faults and key in ("", "points"))


def headings(path: Path) -> list[str]:
    """The columns of a file, in small letters and without units; none if it cannot be read."""
    try:
        with regular_file(path, "file", CSV_MIB).open(encoding="utf-8-sig", newline="") as file:
            first = file.readline()
    except (InputError, OSError, UnicodeDecodeError):
        return []
    header: list[str] = next(csv.reader([first], delimiter=_delimiter(first)), [])
    return [_heading(cell) for cell in header]


def read_columns(path: Path, headings: Mapping[str, str]) -> Rows:
    """The columns of a file, row by row, by name and heading; others are ignored. Bad rows are faults.

    Cells are separated by what the header has of ; tab and comma, in this order; a comma that separates
    nothing is a decimal one. A heading may be written large and end in its unit, mm; a row of units may
    follow.
    """
    read = Rows(path)
    try:
        with regular_file(path, "file", CSV_MIB).open(encoding="utf-8-sig", newline="") as file:
            first = file.readline()
            delimiter = _delimiter(first)
            file.seek(0)
            _read(csv.reader(file, delimiter=delimiter), delimiter, headings, read)
    except InputError as error:
        read.faults.extend(error.faults)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = getattr(error, "strerror", None) or str(error)
        read.faults.append(Fault(str(path), "file", why, "a readable comma-separated file"))
    return read


def _read(reader: Any, delimiter: str, headings: Mapping[str, str], read: Rows) -> None:
    header: list[str] = next(reader, [])
    found = [_heading(cell) for cell in header]
    wanted = [_heading(heading) for heading in headings.values()]
    if any(found.count(heading) != 1 for heading in wanted):
        allowed = f"a header line with the columns {', '.join(headings.values())}, once each"
        read.faults.append(Fault(str(read.path), "line 1", delimiter.join(header), allowed))
        return
    columns = [found.index(heading) for heading in wanted]
    for cells in reader:
        own = [cells[column].strip() if column < len(cells) else "" for column in columns]
        units = reader.line_num == 2 and any(own) and {_heading(cell) for cell in own} == {""}
        if units or not any(cell.strip() for cell in cells):
            continue
        try:
            row = tuple(float(cell if delimiter == "," else cell.replace(",", ".")) for cell in own)
        except ValueError:
            row = (math.nan,)
        if all(map(math.isfinite, row)) and not any(cells[len(header) :]):  # 0,5 would be two cells
            read.rows.append(row)
            read.lines.append(reader.line_num)
        else:
            allowed = f"a finite number in each of the columns {', '.join(headings.values())}"
            line = delimiter.join(cells)
            read.faults.append(Fault(str(read.path), f"line {reader.line_num}", line, allowed))
    if not read.rows and not read.faults:
        read.faults.append(Fault(str(read.path), "rows", 0, "at least one row below the header"))


def _delimiter(header: str) -> str:
    return next((mark for mark in ";\t" if mark in header), ",")


def _heading(cell: str) -> str:
    """Without its unit, if that is mm, in small letters."""
    return UNIT.sub("", cell.strip()).lower()
