"""Whether the fields of rows are of the schema's kinds: a file may hold anything."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from problems.errors import Fault, InputError
from problems.input.bounded import regular_file

from . import records
from .checksums import arrays_in, parsed
from .records import Row
from .schema import FIELDS, PROBLEM_FIELDS, Kind

MAX_MIB = 1024  # of a file beside the rows
MAX_FAULTS = 20  # named at once
LARGEST = sys.float_info.max  # of an integer: what is larger is no number of ours
TYPES: dict[Kind, tuple[type, ...]] = {
    "number": (int, float),
    "text": (str,),
    "flag": (bool,),
    "object": (dict,),
}


def refuse_wrong_kinds(
    path: Path,
    rows: Sequence[Row],
    fields: Mapping[str, Kind] = FIELDS,
    needed: Sequence[str] = ("scene",),
) -> None:
    """Raise InputError naming file, line and field if a field is of another kind, or a needed one is null.

    Any other field may be null.
    """
    faults = [
        Fault(str(path), f"line {number}: {name}", value, f"must be a {fields[name]} or null")
        for number, row in enumerate(rows, start=1)
        for name, value in row.items()
        if name in fields and value is not None and not _is_of_kind(value, fields[name])
    ]
    faults += [
        Fault(str(path), f"line {number}: {name}", None, "is missing from the row")
        for number, row in enumerate(rows, start=1)
        for name in needed
        if row.get(name) is None
    ]
    if faults:
        raise InputError(faults[:MAX_FAULTS])


def _is_of_kind(value: object, kind: Kind) -> bool:
    too_large = isinstance(value, int) and abs(value) > LARGEST
    return type(value) in TYPES[kind] and not too_large


def refuse_unreadable(directory: Path) -> None:
    """Raise InputError, naming file and line, unless the rows of DIRECTORY can be reported on."""
    path = directory / records.MEASUREMENTS
    rows = records.read(path)
    if not rows:
        raise InputError.one("DIR", "directory", str(directory), f"{path.name} has no row yet")
    refuse_wrong_kinds(path, rows)
    problems = directory / "problems.jsonl"
    refuse_wrong_kinds(problems, records.read(problems), PROBLEM_FIELDS)
    refuse_damaged(directory.glob("machine*.json"), parsed)
    refuse_damaged(directory.glob("scenes/*.npz"), arrays_in)


def refuse_damaged(paths: Iterable[Path], read: Callable[[bytes], object]) -> None:
    """Raise InputError naming each file that `read` refuses by a ValueError."""
    faults = []
    for path in sorted(paths):
        try:
            read(regular_file(path, "content", MAX_MIB).read_bytes())
        except ValueError as error:
            faults.append(Fault(str(path), "content", str(error)[:80], "delete it, and run again"))
    if faults:
        raise InputError(faults[:MAX_FAULTS])
