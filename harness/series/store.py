"""The files of a series: rows and gaps that survive an abrupt end, and the identity of the series.

cases.jsonl   one row per case, in the order of completion
gaps.f4       the final gaps, float32 (relative rounding error at most 6e-8), case k at the bytes
              4km … 4(k + 1)m. A case's gaps are written and synced before its row.
series.json   the identity of the series: the same command resumes it, another one is refused.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.results import records
from problems.errors import Fault, InputError
from problems.load_cases.base import LoadCases

from .session import Result

CASES, GAPS, SERIES = "cases.jsonl", "gaps.f4", "series.json"
CHUNK = 2**20  # bytes
MAX_FAULTS = 10  # named at once
BYTES = np.dtype(np.float32).itemsize


def open_series(directory: Path, identity: dict[str, Any], facts: dict[str, Any]) -> None:
    """Write series.json. Raises InputError if DIRECTORY holds another series, naming each difference."""
    path = directory / SERIES
    if path.is_file():
        before = json.loads(path.read_text("utf-8"))["identity"]
        faults = [
            Fault(str(path), key, before.get(key), f"now {value!r}: name another directory with --out")
            for key, value in json.loads(json.dumps(identity)).items()
            if before.get(key) != value
        ]
        if faults:
            raise InputError(faults)
    content = {"identity": identity, **facts}
    records.replace_text(path, json.dumps(content, indent=1, ensure_ascii=False) + "\n")


def solved(directory: Path, cases: LoadCases) -> NDArray[np.bool_]:
    """(count,) which cases have a row. A torn last line is cut off.

    Raises InputError if a row has other parameters than its case now, as after a change of a table.
    """
    done, faults = np.zeros(cases.count, dtype=bool), []
    path = directory / CASES
    if path.exists():
        _cut_torn_line(path)
        for row in rows(directory):
            if row["case"] >= cases.count:
                continue
            done[row["case"]] = True
            for key, value in cases.parameters(row["case"]).items():
                if row[key] != value:
                    allowed = f"is now {value!r}: name another directory with --out"
                    faults.append(Fault(str(path), f"case {row['case']}, {key}", row[key], allowed))
    if faults:
        raise InputError(faults[:MAX_FAULTS])
    return done


def rows(directory: Path) -> Iterator[dict[str, Any]]:
    """The rows one by one; none if there is no file. Raises InputError at a line that is not JSON."""
    path = directory / CASES
    if not path.exists():
        return
    with path.open("rb") as file:
        for number, line in enumerate(file, start=1):
            try:
                yield json.loads(line)
            except ValueError as error:
                what = line[:80].decode(errors="replace")
                raise InputError.one(path, f"line {number}", what, "not a JSON object") from error


def append(directory: Path, results: Sequence[Result], m: int) -> None:
    """Gaps first, then rows, each synced."""
    with_gaps = [(result.row["case"], result.gap) for result in results if result.gap is not None]
    if with_gaps:
        descriptor = os.open(directory / GAPS, os.O_WRONLY | os.O_CREAT, 0o644)
        try:
            for case, gap in with_gaps:
                assert gap is not None
                os.pwrite(descriptor, gap.tobytes(), case * m * BYTES)
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    records.append(directory / CASES, *(result.row for result in results))


def _cut_torn_line(path: Path) -> None:
    """Cut off what follows the last newline: the case of a torn row is solved again."""
    size = path.stat().st_size
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
