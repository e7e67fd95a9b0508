"""Columns of numbers from a comma-separated file with a header, checked row by row."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

from pydantic import ValidationInfo

from .errors import Fault, InputError


def read_columns(path: Path, names: tuple[str, ...]) -> list[tuple[float, ...]]:
    """The named columns, row by row; other columns are passed over.

    Raises InputError with every bad row by its line in the file.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            return _rows(path, csv.reader(file), names)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InputError.one(path, "file", why, "a readable comma-separated file") from error


def _rows(path: Path, reader: Any, names: tuple[str, ...]) -> list[tuple[float, ...]]:
    header = [cell.strip() for cell in next(reader, [])]
    wanted = f"a first line that names the columns {', '.join(names)}, separated by commas"
    if not set(names) <= set(header):
        raise InputError.one(path, "line 1", ",".join(header), wanted)
    columns = [header.index(name) for name in names]
    rows: list[tuple[float, ...]] = []
    faults: list[Fault] = []
    for cells in reader:
        if not any(cell.strip() for cell in cells):
            continue
        try:
            row = tuple(float(cells[column]) for column in columns)
        except (ValueError, IndexError):
            row = (math.nan,)
        if all(map(math.isfinite, row)):
            rows.append(row)
        else:
            allowed = f"a finite number in each of the columns {', '.join(names)}"
            faults.append(Fault(str(path), f"line {reader.line_num}", ",".join(cells), allowed))
    if not rows and not faults:
        faults.append(Fault(str(path), "rows", 0, "at least one row below the header"))
    if faults:
        raise InputError(faults)
    return rows


def in_place_of_file(data: Any, info: ValidationInfo, field: str, names: tuple[str, ...]) -> Any:
    """A table with `file = "x.csv"` becomes one with its rows as `field`, so that a key depends on them.

    A path is relative to the folder of the scene, which the validation's context gives.
    """
    if not isinstance(data, dict) or "file" not in data:
        return data
    if field in data:
        raise ValueError(f"give either {field} or file")
    rest = {key: value for key, value in data.items() if key != "file"}
    folder = (info.context or {}).get("folder", Path())
    return rest | {field: read_columns(folder / str(data["file"]), names)}
