"""The [[effect]] tables of a scene and the CSV files that they name, read into effects; all their faults."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from problems.errors import Fault, InputError
from problems.input.bounded import regular_file, unknown, validation_faults

from .effect import EXCLUDED, Effect, effect_class, effect_kinds, unknown_part
from .joint import Faults, Joint

CSV_MIB = 100


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
            self.rows = read_columns(self.where.parent / str(content["file"]), effect.columns)
            content = {key: value for key, value in content.items() if key != "file"}
            content["points"] = self.rows.rows
        try:
            self.effect = effect.model_validate(content)
        except ValidationError as error:
            for fault in validation_faults(self.where, effect, error, self._name):
                if not self._is_consequence(fault.key.removeprefix(self._name).lstrip(".")):
                    yield fault
        yield from self.rows.faults if self.rows else ()

    def misfits(self, joint: Joint, tables: Sequence[EffectTable]) -> Iterator[Fault]:
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


def read_columns(path: Path, names: tuple[str, ...]) -> Rows:
    """The named columns of a file, row by row; other columns are ignored. Bad rows are faults."""
    read = Rows(path)
    try:
        with regular_file(path, "file", CSV_MIB).open(encoding="utf-8-sig", newline="") as file:
            _read(csv.reader(file), names, read)
    except InputError as error:
        read.faults.extend(error.faults)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = getattr(error, "strerror", None) or str(error)
        read.faults.append(Fault(str(path), "file", why, "a readable comma-separated file"))
    return read


def _read(reader: Any, names: tuple[str, ...], read: Rows) -> None:
    header = [cell.strip() for cell in next(reader, [])]
    if not set(names) <= set(header):
        wanted = f"a header line with the columns {', '.join(names)}, separated by commas"
        read.faults.append(Fault(str(read.path), "line 1", ",".join(header), wanted))
        return
    columns = [header.index(name) for name in names]
    for cells in reader:
        if not any(cell.strip() for cell in cells):
            continue
        try:
            row = tuple(float(cells[column]) for column in columns)
        except (ValueError, IndexError):
            row = (math.nan,)
        if all(map(math.isfinite, row)):
            read.rows.append(row)
            read.lines.append(reader.line_num)
        else:
            allowed = f"a finite number in each of the columns {', '.join(names)}"
            read.faults.append(Fault(str(read.path), f"line {reader.line_num}", ",".join(cells), allowed))
    if not read.rows and not read.faults:
        read.faults.append(Fault(str(read.path), "rows", 0, "at least one row below the header"))
