"""Columns of numbers from a comma-separated file with a header, checked row by row."""

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationInfo

from problems.errors import Fault, InputError

from .bounded import regular_file

CSV_MIB = 100


@dataclass(frozen=True)
class Rows:
    """The good rows of a file that a table names instead of a field, their line numbers, and the faults."""

    path: Path
    field: str
    rows: list[tuple[float, ...]]
    lines: list[int]
    faults: list[Fault]

    def line(self, key: str) -> tuple[str, str] | None:
        """The file and line of the row that a key such as `points[3]` refers to."""
        place = re.fullmatch(rf"{self.field}\[(\d+)\]", key)
        return (str(self.path), f"line {self.lines[int(place[1])]}") if place else None


def read_columns(path: Path, field: str, names: tuple[str, ...]) -> Rows:
    """The named columns of a file, row by row; other columns are ignored. Bad rows are faults."""
    read = Rows(path, field, [], [], [])
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


def rows_from_file(data: Any, info: ValidationInfo, field: str, names: tuple[str, ...]) -> Any:
    """Replace `file = "x.csv"` in a table by the file's good rows as `field`, so that a key depends on them.

    The validation context holds `folder`, the scene's folder, to which the path is relative, and `files`, a
    list to which the rows read are appended.
    """
    if not isinstance(data, dict) or "file" not in data:
        return data
    if field in data:
        raise ValueError(f"give either {field} or file")
    rest = {key: value for key, value in data.items() if key != "file"}
    context: dict[str, Any] = info.context or {}
    read = read_columns(context["folder"] / str(data["file"]), field, names)
    context["files"].append(read)
    return rest | {field: read.rows}
