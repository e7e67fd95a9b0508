"""The series that a directory holds: the same command resumes it, another one is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.results import series_file
from harness.results.records import to_line
from harness.results.schema import SERIES
from problems.errors import Fault, InputError
from problems.load_cases import LoadCases

OTHER = "name another directory with --out"
MAX_FAULTS = 10  # named at once


def open_series(directory: Path, identity: dict[str, Any], facts: dict[str, Any]) -> None:
    """Write identity and facts. Raises InputError, naming each difference, if another series is there."""
    series_file.create(directory)
    before = series_file.read_facts(directory)
    if before is not None:
        faults = [
            Fault(str(directory / SERIES), key, before["identity"].get(key), f"now {value!r}: {OTHER}")
            for key, value in json.loads(to_line(identity)).items()
            if before["identity"].get(key) != value
        ]
        if faults:
            raise InputError(faults)
    series_file.write_fact(directory, "series", to_line({"identity": identity, **facts}))


def solved(directory: Path, cases: LoadCases) -> NDArray[np.bool_]:
    """(count,) which cases have a row.

    Raises InputError if one has other parameters than its case now, as after a change of a table.
    """
    done, faults = np.zeros(cases.count, dtype=bool), []
    for row in series_file.rows(directory):
        case = row["case"]
        if case >= cases.count:
            continue
        done[case] = True
        for name, value in cases.parameters(case).items():
            if row.get(name) != value:
                where, allowed = f"case {case}, {name}", f"is now {value!r}: {OTHER}"
                faults.append(Fault(str(directory / SERIES), where, row.get(name), allowed))
    if faults:
        raise InputError(faults[:MAX_FAULTS])
    return done
