"""Checks the rows of a file on reading: a file may hold anything."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError, create_model

from problems.errors import Fault, InputError

from . import records
from .records import Row
from .schema import FIELDS, PROBLEM_FIELDS, Kind

MAX_FAULTS = 20  # named at once
TYPES: dict[Kind, Any] = {"number": float, "text": str, "flag": bool, "object": dict[str, Any]}


def model_of(name: str, fields: Mapping[str, Kind]) -> type[BaseModel]:
    """A model of rows with these fields, each of its kind or null; others are ignored."""
    types: dict[str, Any] = {field: (TYPES[kind] | None, None) for field, kind in fields.items()}
    return create_model(name, __config__=ConfigDict(strict=True, extra="ignore"), **types)


MEASUREMENT = model_of("Measurement", FIELDS)
PROBLEM = model_of("Problem", PROBLEM_FIELDS)


def valid_rows(
    path: Path, model: type[BaseModel] = MEASUREMENT, needed: Sequence[str] = ("scene",)
) -> list[Row]:
    """The rows of a file; none if there is none.

    Raises InputError naming file, line and field if a field is of another kind, or a needed one is null.
    """
    rows = records.read(path)
    faults: list[Fault] = []
    for number, row in enumerate(rows, start=1):
        try:
            model.model_validate(row)
        except ValidationError as error:
            for wrong in error.errors(include_url=False):
                name = str(wrong["loc"][0])
                where, allowed = f"line {number}: {name}", f"{wrong['msg']}, or null"
                faults.append(Fault(str(path), where, row[name], allowed))
        faults += [
            Fault(str(path), f"line {number}: {name}", None, "is missing from the row")
            for name in needed
            if row.get(name) is None
        ]
    if faults:
        raise InputError(faults[:MAX_FAULTS])
    return rows


def measured_rows(directory: Path, needed: Sequence[str] = ("scene",)) -> list[Row]:
    """The rows of DIRECTORY, at least one. Raises InputError, as `valid_rows` does."""
    path = directory / records.MEASUREMENTS
    if not path.is_file():
        raise InputError.one("DIR", "directory", str(directory), f"has no {path.name}; `run` creates one")
    rows = valid_rows(path, needed=needed)
    if not rows:
        raise InputError.one("DIR", "directory", str(directory), f"{path.name} has no row yet")
    return rows


def refuse_unreadable(directory: Path) -> None:
    """Raise InputError, naming file and line, unless the rows of DIRECTORY can be reported on."""
    measured_rows(directory)
    valid_rows(directory / "problems.jsonl", PROBLEM)
    faults = list[Fault]()
    for path in sorted([*directory.glob("machine*.json"), *directory.glob("scenes/*.npz")]):
        try:
            if path.suffix == ".npz":
                records.read_arrays(path)
            else:
                records.read_object(path)
        except InputError as error:
            faults += error.faults
        except ValueError as error:
            faults.append(Fault(str(path), "content", str(error)[:80], "delete it, and run again"))
    if faults:
        raise InputError(faults[:MAX_FAULTS])
