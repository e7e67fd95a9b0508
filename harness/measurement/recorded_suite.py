"""The suite.toml of a results directory, by which the gate knows which rows there should be."""

from collections.abc import Sequence
from pathlib import Path

from harness.planning.plan import Measurement, expand
from harness.planning.suite import Suite, read_written, to_toml
from harness.planning.tolerance_search import unmeasured
from harness.results import records
from harness.results.records import OTHER, Row
from problems.errors import Fault, InputError

SUITE = "suite.toml"


def other_suite(directory: Path, suite: Suite) -> list[str]:
    """The name of the directory's suite.toml, if it has one that is of another suite."""
    path = directory / SUITE
    return [SUITE] if path.is_file() and path.read_bytes() != to_toml(suite).encode() else []


def record_suite(
    directory: Path, suite: Suite, plan: Sequence[Measurement], rows: Sequence[Row], key: str | None = None
) -> None:
    """Write suite.toml; with a key, only into a directory that has neither one nor rows.

    Raises InputError if the directory has the row of the key, or a damaged suite.toml; or if that plans rows
    that are still to be made and that `plan` lacks: nobody would miss them any more.
    """
    path, text = directory / SUITE, to_toml(suite)
    if key is not None:
        if any(row["key"] == key for row in rows):
            raise InputError.one("--key", "key", key, f"{directory} has its row: {OTHER}")
        if path.exists():
            read_written(path)  # the report reads it once the row is there
        if rows or path.exists():
            return
    elif other_suite(directory, suite):
        planned = {m.key for m in plan}
        try:
            earlier = expand(read_written(path))
        except InputError as error:
            why = f"which rows it lacks cannot be known from its {path.name}: {OTHER}"
            raise InputError([*error.faults, Fault("--out", "directory", str(directory), why)]) from error
        if lost := [m.key for m in unmeasured(earlier, rows) if m.key not in planned]:
            why = f"its {path.name} plans {lost[0]}, which has no row yet and is not in this run"
            raise InputError.one("--out", "directory", str(directory), f"{why}: finish that run, or {OTHER}")
    records.replace_text(path, text)
