"""The files of a series: rows and gaps that survive an abrupt end, and the identity of the series.

cases.jsonl   one row per case, in the order of completion; with the key of its series and the CRC-32 of
              its gaps
gaps.f4       the final gaps, float32 (relative rounding error at most 6e-8), case k at the bytes
              4km … 4(k + 1)m. A case's gaps are written and synced before its row.
contacts.npz  where the contacts and the fasteners are, and m
series.json   the identity of the series: the same command resumes it, another one is refused.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.results import records
from harness.results.checksums import DAMAGED, Damaged, arrays_in, parsed
from harness.results.schema import CASES, GAPS, VERDICTS
from problems.errors import Fault, InputError
from problems.input.bounded import LARGEST, regular_file
from problems.load_cases.base import LoadCases
from problems.storage.cache import digest

from .gap_file import CRC, GapFile, checksum, write_gaps
from .session import Result

CONTACTS, SERIES = "contacts.npz", "series.json"
UNITS = ("_mm", "_s")  # of the fields that are numbers
AGAIN = "run the same `series` command again"
DELETE = f"delete it, and {AGAIN}"
MAX_CASES = 10**9
CHUNK = 2**20  # bytes
MAX_MIB = 1024  # of contacts.npz
MAX_FAULTS = 10  # named at once


def series_key(identity: dict[str, Any]) -> str:
    """What each row names its series by."""
    return digest(json.loads(json.dumps(identity)))[:12]


def open_series(directory: Path, identity: dict[str, Any], facts: dict[str, Any]) -> None:
    """Write series.json. Raises InputError if DIRECTORY holds another series, naming each difference, or rows
    of which nothing says whether they belong to this one.
    """
    path = directory / SERIES
    if path.is_file():
        before = read_series(directory)["identity"]
        faults = [
            Fault(str(path), key, before.get(key), f"now {value!r}: name another directory with --out")
            for key, value in json.loads(json.dumps(identity)).items()
            if before.get(key) != value
        ]
        if faults:
            raise InputError(faults)
    else:
        for row in rows(directory):
            if row.get("series") != series_key(identity):
                allowed = f"of an unknown series without {SERIES}: name another directory with --out"
                raise InputError.one(directory / CASES, f"case {row['case']}", row.get("series"), allowed)
    records.replace_object(path, {"identity": identity, **facts})


def read_series(directory: Path) -> dict[str, Any]:
    """The content of series.json. Raises InputError if it is damaged."""
    path = directory / SERIES
    try:
        content = parsed(path.read_bytes())
        identity = content["identity"]
        whole = 0 <= content["cases"] <= MAX_CASES and 0 < identity["tolerance"] < inf
        whole &= all(type(content[name]) is int for name in ("cases", "threads"))
        whole &= all(isinstance(content[name], str) for name in ("scene", "title", "machine"))
        whole &= all(isinstance(identity[name], str) for name in ("solver", "form"))
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise InputError.one(path, "content", str(error)[:80], DELETE) from error
    if not whole:
        raise InputError.one(path, "content", "not what was written", DELETE)
    return dict(content)


def solved(directory: Path, cases: LoadCases, key: str, m: int) -> tuple[NDArray[np.bool_], int]:
    """(count,) which cases have a row and its gaps, and the number of rows that were removed because their
    gaps are missing or damaged, or because another row is of the same case. A torn last line is cut off.

    Raises InputError if a row is of another series, or has other parameters than its case now, as after a
    change of a table.
    """
    done, faults, removed = np.zeros(cases.count, dtype=bool), [], 0
    path = directory / CASES
    if not path.exists():
        return done, 0
    _cut_torn_line(path)
    new = path.with_name(path.name + ".new")
    with new.open("wb") as kept, GapFile(directory, m) as gaps:
        for line, row in _lines(path):
            case = row["case"]
            if row.get("series", key) != key:
                allowed = "of another series: name another directory with --out"
                faults.append(Fault(str(path), f"case {case}", row["series"], allowed))
            if case < cases.count:
                if done[case] or not gaps.whole(row):
                    removed += 1
                    continue
                done[case] = True
                for name, value in cases.parameters(case).items():
                    if row.get(name) != value:
                        allowed = f"is now {value!r}: name another directory with --out"
                        faults.append(Fault(str(path), f"case {case}, {name}", row.get(name), allowed))
            kept.write(line)
        kept.flush()
        os.fsync(kept.fileno())
    if removed and not faults:
        new.replace(path)
    new.unlink(missing_ok=True)
    if faults:
        raise InputError(faults[:MAX_FAULTS])
    return done, removed


def refuse_damaged(directory: Path) -> None:
    """Raise InputError, naming file and case, unless the series can be reported on."""
    facts = read_series(directory)
    m = contacts_in(directory)
    if not m:
        raise InputError.one(directory / CONTACTS, "content", "missing or damaged", AGAIN)
    with GapFile(directory, m) as gaps:
        wrong = [
            Fault(str(directory / GAPS), f"case {row['case']}", "missing or damaged", AGAIN)
            for row in rows(directory)
            if row["case"] < facts["cases"] and not gaps.whole(row, older=True)
        ]
    if wrong:
        raise InputError(wrong[:MAX_FAULTS])


def contacts_in(directory: Path) -> int:
    """m, as contacts.npz has it; 0 if it is missing or damaged."""
    try:
        arrays = arrays_in(regular_file(directory / CONTACTS, "content", MAX_MIB).read_bytes())
        m = int(arrays["m"])
    except (OSError, ValueError, TypeError, KeyError):
        return 0
    nodes = arrays.get("contact_nodes", np.zeros((m, 2)))
    fasteners = arrays.get("fasteners", np.zeros((0, 2)))
    whole = nodes.shape == (m, 2) and fasteners.ndim == 2 and fasteners.shape[1] == 2
    whole = whole and nodes.dtype.kind == fasteners.dtype.kind == "f"
    return m if whole and all((abs(places) <= LARGEST).all() for places in (nodes, fasteners)) else 0


def rows(directory: Path) -> Iterator[records.Row]:
    """The rows one by one; none if there is no file. Raises InputError at a line that is no row."""
    path = directory / CASES
    if path.exists():
        yield from (row for _, row in _lines(path))


def _lines(path: Path) -> Iterator[tuple[bytes, records.Row]]:
    """The lines that end, and the rows in them."""
    with regular_file(path, "content", inf).open("rb") as file:
        for number, line in enumerate(file, start=1):
            if not line.endswith(b"\n"):
                return
            try:
                row = parsed(line)
            except ValueError as error:
                what = line[:80].decode(errors="replace")
                why = DAMAGED if isinstance(error, Damaged) else "not a JSON object"
                allowed = f"{why}; delete the line, and {AGAIN}"
                raise InputError.one(path, f"line {number}", what, allowed) from error
            for name in ("case", "verdict", *row):
                if not _valid(name, row.get(name)):
                    raise InputError.one(
                        path, f"line {number}, {name}", row.get(name), "not what was written"
                    )
            yield line, row


def _valid(name: str, value: object) -> bool:
    match name:
        case "case":
            return type(value) is int and 0 <= value < MAX_CASES
        case "verdict":
            return value in VERDICTS
    return not name.endswith(UNITS) or value is None or type(value) in (int, float)


def append(directory: Path, results: Sequence[Result], m: int, key: str) -> None:
    """Gaps first, then rows, each synced. key : of the series."""
    write_gaps(directory, [(result.row["case"], result.gap) for result in results], m)
    checked = [
        result.row | {"series": key} | ({} if result.gap is None else {CRC: checksum(result.gap)})
        for result in results
    ]
    records.append(directory / CASES, *checked)


def _cut_torn_line(path: Path) -> None:
    """Cut off what follows the last newline: the case of a torn row is solved again."""
    size = regular_file(path, "content", inf).stat().st_size
    with path.open("rb") as file:
        end = size
        while end:
            start = max(end - CHUNK, 0)
            file.seek(start)
            newline = file.read(end - start).rfind(b"\n")
            if newline >= 0:
                end = start + newline + 1
                break
            end = start
    if end < size:
        os.truncate(path, end)
