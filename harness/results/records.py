"""The files of a results directory: rows that survive however the run ends.

A row is one JSON line in measurements.jsonl, appended and synced before the next measurement starts. An
abrupt end can only leave a torn last line, which the next run removes.
"""

import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import filelock
import numpy as np
from numpy.typing import NDArray

from problems.errors import Fault, InputError
from problems.input.bounded_types import regular_file

from .schema import SERIES

Row = dict[str, Any]

MEASUREMENTS, PLANS, SHIMS, TOLERANCE = "measurements.jsonl", "plans.jsonl", "shims.jsonl", "tolerance.json"
#: The file by which each command continues an interrupted run; a directory has one of them at most.
JOURNALS = (MEASUREMENTS, SERIES, PLANS, SHIMS, TOLERANCE)
OUTDATED = "measurements.outdated.jsonl"
PASSING = {"crashed": "SIGKILL", "failed": "took more than"}
ROWS_MIB, ARRAYS_MIB = 4096, 1024  # of a file that is read
OTHER = "name another directory with --out"


def to_line(row: Row, indent: int | None = None) -> str:
    """Strict JSON, one line unless it is indented: non-finite numbers become null, and lone surrogates, as in
    a file name that is not UTF-8, their JSON escapes.
    """
    text = json.dumps(_plain(row), ensure_ascii=False, allow_nan=False, indent=indent)
    return text.encode("utf-8", "backslashreplace").decode()


def _plain(value: Any) -> Any:
    match value:
        case None | bool() | int() | str():
            return value
        case float():
            return value if math.isfinite(value) else None
        case np.generic():
            return _plain(value.item())
        case np.ndarray():
            return _plain(value.tolist())
        case dict():
            return {str(k): _plain(v) for k, v in value.items()}
        case list() | tuple() | set():
            return [_plain(v) for v in value]
    return str(value)


def may_pass(row: Row) -> bool:
    """Whether the cause of a failure may be over, so that a further run tries again: SIGKILL ended the
    process, as where memory ran out, or opening or judging took too long.
    """
    status = row.get("status") or ""
    return status in PASSING and PASSING[status] in (row.get("message") or "")


def append(path: Path, *rows: Row) -> None:
    """Append one line per row and force them to disk; on failure (a full disk) restore the file."""
    rest = memoryview("".join(to_line(row) + "\n" for row in rows).encode())
    with path.open("ab", buffering=0) as file:  # a buffer would write its remainder on closing
        size = file.seek(0, os.SEEK_END)
        try:
            while rest:
                rest = rest[file.write(rest) :]
            os.fsync(file.fileno())
        except OSError:
            os.truncate(path, size)
            raise


def read(path: Path) -> list[Row]:
    """All rows; none if there is no file. Raises InputError naming a line that is torn or not JSON."""
    rows, torn = _split(path)
    if torn:
        allowed = "torn by an interrupted run; `run` into the same directory removes it and continues"
        raise InputError.one(path, f"line {len(rows) + 1}", torn.decode(errors="replace"), allowed)
    return rows


def remove_torn_line(path: Path) -> bool:
    """Remove a torn last line; returns whether there was one."""
    _, torn = _split(path)
    if torn:
        os.truncate(path, path.stat().st_size - len(torn))
    return bool(torn)


def _split(path: Path) -> tuple[list[Row], bytes]:
    """The complete rows, and the bytes of a torn last line."""
    content = regular_file(path, "file", ROWS_MIB).read_bytes() if path.exists() else b""
    *lines, last = content.split(b"\n")
    rows: list[Row] = []
    for number, line in enumerate(lines, start=1):
        try:
            row = parsed(line)
        except ValueError:
            row = None
        if row is None and number == len(lines) and not last:
            return rows, line + b"\n"
        if row is None:
            raise InputError.one(path, f"line {number}", line.decode(errors="replace"), "not a JSON object")
        rows.append(row)
    return rows, last


def parsed(text: str | bytes) -> Row:
    """The JSON object in a text. Raises ValueError if it is none."""
    try:
        content: object = json.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deep") from error
    if not isinstance(content, dict):
        raise ValueError("not a JSON object")
    return content


def read_object(path: Path) -> Row:
    """The JSON object in a file. Raises InputError if it is none."""
    try:
        return parsed(regular_file(path, "content", ROWS_MIB).read_bytes())
    except InputError:
        raise
    except ValueError as error:
        raise InputError.one(path, "content", str(error)[:80], "delete it, and run again") from error


def rewrite(path: Path, rows: list[Row]) -> None:
    """Replace the rows of the file, atomically."""
    replace_text(path, "".join(to_line(row) + "\n" for row in rows))


def replace_object(path: Path, content: Row) -> None:
    """Write a JSON object, atomically."""
    replace_text(path, to_line(content, indent=1) + "\n")


def replace_text(path: Path, text: str) -> None:
    """Write a file atomically."""
    with _replacing(path) as file:
        file.write(text.encode())


def replace_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write a .npz file, atomically."""
    with _replacing(path) as file:
        np.savez(file, **arrays)


def read_arrays(source: Path | BinaryIO) -> dict[str, NDArray[Any]]:
    """The arrays of a .npz file, whose CRC is checked. Raises ValueError if it is none."""
    try:
        opened = regular_file(source, "content", ARRAYS_MIB) if isinstance(source, Path) else source
        with np.load(opened) as file:
            arrays = dict(file)
    except InputError:
        raise
    except Exception as error:  # numpy, zipfile and zlib raise kinds of their own
        raise ValueError(f"not a .npz file: {error}") from error
    if not all(isinstance(array, np.ndarray) for array in arrays.values()):
        raise ValueError("not a .npz file: a member is no array")
    return arrays


@contextmanager
def _replacing(path: Path) -> Iterator[BinaryIO]:
    """A file that takes the place of PATH once it is whole and on disk."""
    new = path.with_name(path.name + ".new")
    try:
        with new.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        new.replace(path)
    finally:
        new.unlink(missing_ok=True)


def refuse_other(path: Path, recorded: Row, identity: Row) -> None:
    """Raise InputError, naming each difference, if PATH belongs to a command of another identity."""
    faults = [
        Fault(str(path), key, recorded.get(key), f"now {value!r}: {OTHER}")
        for key, value in parsed(to_line(identity)).items()
        if recorded.get(key) != value
    ]
    if faults:
        raise InputError(faults)


def refuse_other_command(directory: Path, journal: str, outputs: Sequence[str] = ()) -> None:
    """Raise InputError if the directory has the journal of another command than the one whose journal is
    `journal`, or some of the outputs without it.
    """
    names = (*JOURNALS, *(() if (directory / journal).exists() else outputs))
    if there := [name for name in names if name != journal and (directory / name).exists()]:
        allowed = f"has {there[0]} of another command: name another directory"
        raise InputError.one("--out", "directory", str(directory), allowed)


@contextmanager
def locked(
    directory: Path, journal: str = MEASUREMENTS, folders: Sequence[str] = (), outputs: Sequence[str] = ()
) -> Iterator[None]:
    """Create the directory and lock it against a second run. Raises InputError if that fails, or as
    `refuse_other_command`.
    """
    refuse_other_command(directory, journal, outputs)
    try:
        for folder in ("", *folders):
            (directory / folder).mkdir(parents=True, exist_ok=True)
        lock = filelock.FileLock(directory / ".lock", timeout=0)
        lock.acquire()
    except filelock.Timeout:
        allowed = "another run is writing here: wait, or name another directory"
        raise InputError.one("--out", "directory", str(directory), allowed) from None
    except OSError as error:
        raise InputError.one("--out", "directory", str(directory), f"cannot be written: {error}") from error
    try:
        yield
    finally:
        lock.release()
