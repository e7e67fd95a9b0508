"""series.sqlite: the load cases of a series, each with its row and its gaps, in one file.

    facts    name and value: `series`, JSON, the identity of the series and what a report says of it;
             `contacts`, the bytes of an .npz with m, `contact_nodes` and `fasteners`, mm
    cases    number; row, JSON; gap, (m,) little-endian float32 (relative rounding error at most 6e-8), mm,
             NULL without an answer

Cases are written in transactions: whatever ends the process, a case has its row and its gaps, or neither.
"""

import io
import json
import sqlite3
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, InstanceOf, ValidationError

from problems.errors import InputError
from problems.input.bounded_types import Positive, regular_file, validation_faults

from . import records
from .records import Row, to_line
from .schema import SERIES, VERDICTS

Gaps = NDArray[np.float32]

GAP = np.dtype("<f4")
TABLES = (
    "CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value BLOB NOT NULL)",
    "CREATE TABLE IF NOT EXISTS cases (number INTEGER PRIMARY KEY, row TEXT NOT NULL, gap BLOB)",
)
FACTS = "SELECT value FROM facts WHERE name = 'series'"
ROWS = "SELECT number, row FROM cases WHERE number < ? ORDER BY number"
WITHOUT_GAP = """
SELECT number FROM cases
WHERE (coalesce(length(gap), 0) != ? OR typeof(gap) != 'blob')
    AND json_extract(row, '$.verdict') != 'no_answer' LIMIT 1
"""
DAMAGED = (sqlite3.SQLITE_ERROR, sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)
IN_USE = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
WAIT_S = 600.0  # for another program that reads the file
RETRY_S = 1.0  # Ctrl-C is heard between two tries
AGAIN = "delete it, and run the same `series` command again"
CHECK, CHECK_FILES = "allowed_gap", ("allowed-gap.csv", "allowed-gap.png")  # among the facts; beside the file


class Identity(BaseModel):
    """The facts that all cases of a series share, as far as others read them."""

    model_config = ConfigDict(extra="allow")

    solver: InstanceOf[str]
    form: InstanceOf[str]
    tolerance: Positive


class Facts(BaseModel):
    """The value of `series`."""

    model_config = ConfigDict(extra="allow")

    identity: Identity
    scene: InstanceOf[str]  # perhaps with lone surrogates, as in a file name that is not UTF-8
    title: InstanceOf[str]
    machine: InstanceOf[str]
    cases: int = Field(ge=0, le=10**9)
    threads: int


@contextmanager
def connected(directory: Path, mode: str = "DEFERRED") -> Iterator[sqlite3.Connection]:
    """A connection in a transaction; a block that ends without an error is committed.

    mode : EXCLUSIVE to write. Raises InputError if the file is damaged or none of ours, OSError if the disk
    refuses, or if another program keeps the file for longer than `WAIT_S`.
    """
    path = directory / SERIES
    if path.exists():
        regular_file(path, "content", inf)
    try:
        with closing(sqlite3.connect(path, timeout=RETRY_S)) as connection, connection:
            _begin(connection, mode)
            if path.stat().st_size % connection.execute("PRAGMA page_size").fetchone()[0]:
                raise InputError.one(path, "content", "cut off", AGAIN)
            yield connection
    except (sqlite3.DatabaseError, UnicodeDecodeError) as error:  # its message too
        code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF  # text not UTF-8 has none
        if code in IN_USE:
            raise OSError(f"{path}: another program keeps it open: close that") from error
        if code not in DAMAGED:
            raise OSError(f"{path}: {error}") from error
        raise InputError.one(path, "content", str(error), AGAIN) from error


def _begin(connection: sqlite3.Connection, mode: str) -> None:
    """Begin a transaction, once no other program is in the way: a reader stops a writer."""
    until = time.monotonic() + WAIT_S
    while True:
        try:
            connection.execute(f"BEGIN {mode}")
            connection.execute("SELECT count(*) FROM sqlite_master")  # undoes what was not finished
            return
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode & 0xFF not in IN_USE or time.monotonic() > until:
                raise
            connection.rollback()


def write_fact(directory: Path, name: str, value: str | bytes) -> None:
    """Write or replace a fact; the first one makes the tables."""
    with connected(directory, "EXCLUSIVE") as connection:
        for table in TABLES:
            connection.execute(table)
        connection.execute("INSERT OR REPLACE INTO facts VALUES (?, ?)", (name, value))


def add_facts(directory: Path, more: Mapping[str, Any]) -> None:
    """Put more into the value of `series`, if there is one, as it is by now."""
    with connected(directory, "EXCLUSIVE") as connection:
        fact = connection.execute(FACTS).fetchone()
        if fact is not None:
            value = to_line(records.parsed(fact[0]) | dict(more))
            connection.execute("UPDATE facts SET value = ? WHERE name = 'series'", (value,))


def append(directory: Path, cases: Iterable[tuple[Row, Gaps | None]]) -> None:
    """Write rows with their gaps, all of them or none."""
    with connected(directory, "EXCLUSIVE") as connection:
        connection.executemany(
            "INSERT OR REPLACE INTO cases VALUES (?, ?, ?)",
            ((row["case"], to_line(row), None if gap is None else gap.astype(GAP).tobytes())
             for row, gap in cases),
        )  # fmt: skip


def read_facts(directory: Path) -> dict[str, Any] | None:
    """The value of `series`; None if there is none yet. Raises InputError if it is damaged."""
    path = directory / SERIES
    if not path.exists() or (path.is_file() and path.stat().st_size == 0):  # SQLite begins with an empty one
        return None
    with connected(directory) as connection:
        fact = connection.execute(FACTS).fetchone()
    if fact is None:
        return None
    try:
        content: dict[str, Any] = records.parsed(fact[0])
        Facts.model_validate(content)
    except ValidationError as error:
        raise InputError(list(validation_faults(path, Facts, error))) from error
    except (ValueError, TypeError) as error:
        raise InputError.one(path, "series", str(error), AGAIN) from error
    return content


def rows(directory: Path) -> Iterator[Row]:
    """The rows of the series in the order of their numbers, one by one; none if there is no file.

    Those that an earlier, longer series has left are passed over.
    """
    path, facts = directory / SERIES, read_facts(directory)
    if facts is None:
        return
    with connected(directory) as connection:
        for number, text in connection.execute(ROWS, (facts["cases"],)):
            try:
                row = json.loads(text)
                whole = row["case"] == number and row["verdict"] in VERDICTS
            except (ValueError, TypeError, KeyError):
                whole = False
            if not whole:
                raise InputError.one(path, f"case {number}", str(text)[:80], f"not what was written; {AGAIN}")
            yield row


def write_contacts(directory: Path, arrays: Mapping[str, Any]) -> None:
    """Write m, contact_nodes (m, 2) if they are known, and fasteners (k, 2), mm, for the figures."""
    content = io.BytesIO()
    np.savez(content, **arrays)
    write_fact(directory, "contacts", content.getvalue())


def read_contacts(directory: Path) -> dict[str, NDArray[Any]]:
    """The arrays of `write_contacts`. Raises InputError if they are damaged."""
    path = directory / SERIES
    with connected(directory) as connection:
        fact = connection.execute("SELECT value FROM facts WHERE name = 'contacts'").fetchone()
    if fact is None:
        raise InputError.one(path, "contacts", None, AGAIN)
    try:
        arrays = records.read_arrays(io.BytesIO(fact[0]))
        int(arrays["m"])
    except (ValueError, TypeError, KeyError) as error:
        raise InputError.one(path, "contacts", str(error), AGAIN) from error
    return arrays


class StoredGaps:
    """(cases, m), mm, on disk: indexed by case numbers, or by these and a slice of the contacts."""

    def __init__(self, directory: Path, m: int) -> None:
        self.directory, self.m = directory, m

    def __getitem__(self, key: Any) -> Gaps:
        numbers, contacts = key if isinstance(key, tuple) else (key, slice(None))
        start, stop, step = contacts.indices(self.m)
        cases = np.atleast_1d(numbers).tolist()
        gaps = np.empty((len(cases), len(range(start, stop, step))), np.float32)
        part = "SELECT substr(gap, ?, ?) FROM cases WHERE number = ?"
        where = 1 + GAP.itemsize * start, GAP.itemsize * (stop - start)
        with connected(self.directory) as connection:
            for k, number in enumerate(cases):
                try:
                    (blob,) = connection.execute(part, (*where, number)).fetchone()
                    gaps[k] = np.frombuffer(blob, GAP)[::step]
                except (TypeError, ValueError) as error:
                    path = self.directory / SERIES
                    raise InputError.one(path, f"gaps of case {number}", str(error), AGAIN) from error
        return gaps if np.ndim(numbers) else gaps[0]


def refuse_damaged(directory: Path) -> None:
    """Raise InputError unless the series can be reported on."""
    path = directory / SERIES
    facts, m = read_facts(directory), int(read_contacts(directory)["m"])
    with connected(directory) as connection:
        (state,) = connection.execute("PRAGMA quick_check(1)").fetchone()
        short = connection.execute(WITHOUT_GAP, (m * GAP.itemsize,)).fetchone()
    if state != "ok" or short or facts is None:
        content = f"no gaps of case {short[0]}, as in published series" if short else state
        raise InputError.one(path, "content", content, AGAIN)
    for _ in rows(directory):
        pass
