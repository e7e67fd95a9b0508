"""Puts the rows of several runs, as of several machines, into one directory."""

import shutil
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from harness.measurement.recorded_suite import SUITE
from harness.measurement.suite_run import record_machine
from harness.planning.suite import read_written
from harness.results import records
from harness.results.comparison import Incomparable, Side, read_rows, refuse_incomparable
from harness.results.row_validation import refuse_unreadable
from harness.verification.reference_problem import PROBLEMS
from problems.errors import InputError, read_all

from .suite_runs import report


def merge(names: Sequence[str], out: Path) -> Path:
    """Write a directory of the rows of runs that share measurements, each with its machine; its report.

    Answers stay where they are. Raises InputError; Incomparable if a machine made a measurement in two runs.
    """
    sides = read_all(read_rows, names)
    before = sides[0]
    for side in sides[1:]:
        refuse_incomparable(before, side)
        before = Side(f"{before.name} and {side.name}", before.rows + side.rows)
    older = [row for name in names for row in records.read(Path(name) / records.OUTDATED)]
    for folder in map(Path, names):  # before anything is written
        refuse_unreadable(folder)
        if (folder / SUITE).is_file():
            read_written(folder / SUITE)
        for file in folder.glob("machine*.json"):
            if not isinstance(named := records.read_object(file).get("machine"), str):
                raise InputError.one(file, "machine", named, "the name of the machine")
    rows = [row | dict.fromkeys(("answer", "log")) for side in sides for row in side.rows]
    (((key, machine), count),) = Counter((row.get("key"), row.get("machine")) for row in rows).most_common(1)
    if count > 1:
        raise Incomparable.one(" ".join(names), "key", key, f"one row of {machine}, not {count}")
    if (out / records.MEASUREMENTS).exists():
        raise InputError.one("--out", "directory", str(out), f"has rows: {records.OTHER}")
    with records.locked(out, folders=("scenes",), outputs=("report", SUITE)):
        problems: list[records.Row] = []
        for folder, side in zip(map(Path, names), sides, strict=True):
            machine = side.rows[0].get("machine")
            for file in sorted(folder.glob("machine*.json")):
                record_machine(out, records.read_object(file))
            read = records.read(folder / PROBLEMS)  # older ones do not name their machine
            problems += [row | {"machine": row.get("machine") or machine} for row in read]
            for file in folder.glob("scenes/*.npz"):
                shutil.copy(file, out / file.relative_to(folder))
        records.rewrite(out / PROBLEMS, problems)
        if older:
            records.rewrite(out / records.OUTDATED, older)
        records.rewrite(out / records.MEASUREMENTS, rows)
        for folder in map(Path, names):
            if (folder / SUITE).is_file():
                shutil.copy(folder / SUITE, out)  # last: it is refused without rows
    return report(out)
