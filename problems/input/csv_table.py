"""Columns of numbers from a comma-separated file with a header, checked row by row."""

import csv
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from problems.errors import Fault, InputError

from .bounded import regular_file

CSV_MIB = 100


@dataclass(frozen=True)
class Rows:
    """The good rows of a file, their line numbers, and the faults."""

    path: Path
    rows: list[tuple[float, ...]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)


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
