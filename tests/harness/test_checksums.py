"""Every file of a results or series directory is read as it was written, or refused by name."""

import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import harness
from strip import write_strip

from harness.measurement.run import record_machine
from harness.planning.suite import read_written
from harness.results import checksums, records
from harness.results.kinds import refuse_unreadable
from harness.series import store
from harness.verification.reference_problem import reference_problem
from problems.errors import InputError

pytestmark = pytest.mark.slow

FLIPS = 120  # bytes damaged per file


@pytest.fixture(scope="module")
def directories(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`run`, a directory of results, and `series`."""
    folder = tmp_path_factory.mktemp("whole")
    shutil.copytree(finished, folder / "run")
    write_strip(folder)
    words = ["series", folder / "strip.toml", "--cases", 6, "--check", 0, "--out", folder / "series"]
    assert harness(*words).exit_code == 0
    return folder


@pytest.fixture
def made(directories: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(directories, tmp_path / "copy"))


def arrays_of(directory: Path) -> Any:
    refuse_unreadable(directory)
    (path,) = (directory / "scenes").iterdir()
    with np.load(path) as file:
        return {name: values.tolist() for name, values in file.items()}


def answer_of(directory: Path) -> Any:
    """What the judge says of the saved answer."""
    row = records.read(directory / records.MEASUREMENTS)[0]
    judged = reference_problem(row["source"]).judge_file(directory / row["answer"], 1e-7)
    if judged.verdict == "no_answer":
        raise InputError.one(directory / row["answer"], "content", "damaged", "")
    return judged


def rows_of(directory: Path) -> Any:
    refuse_unreadable(directory)
    return records.read(directory / records.MEASUREMENTS), records.read(directory / "problems.jsonl")


def machine_of(directory: Path) -> Any:
    refuse_unreadable(directory)
    return checksums.parsed((directory / "machine.json").read_bytes())


def series_of(directory: Path) -> Any:
    store.refuse_damaged(directory)
    with np.load(directory / store.CONTACTS) as arrays:
        contacts = {name: arrays[name].tolist() for name in ("m", "contact_nodes", "fasteners")}
    gaps = np.fromfile(directory / store.GAPS, np.float32).tolist()
    return store.read_series(directory), list(store.rows(directory)), contacts, gaps


FILES: list[tuple[str, Callable[[Path], Any]]] = [
    (f"run/{records.MEASUREMENTS}", rows_of),
    ("run/problems.jsonl", rows_of),
    ("run/suite.toml", lambda directory: read_written(directory / "suite.toml")),
    ("run/machine.json", machine_of),
    ("run/scenes/*.npz", arrays_of),
    ("run/answers/*.npz", answer_of),
    *((f"series/{name}", series_of) for name in (store.CASES, store.GAPS, store.CONTACTS, store.SERIES)),
]


def holds(found: Any, wanted: Any) -> bool:
    """Whether it is equal, but for the name of a checksum, which then is a field of its own."""
    if isinstance(wanted, dict):
        return all(name in found and holds(found[name], value) for name, value in wanted.items())
    if isinstance(wanted, list | tuple):
        return len(found) == len(wanted) and all(map(holds, found, wanted))
    return bool(found == wanted)


def outcome(content: Callable[[Path], Any], directory: Path) -> tuple[Any, str]:
    """What is read, or what is said."""
    try:
        return content(directory), ""
    except InputError as error:
        return None, str(error)


@pytest.mark.parametrize(("name", "content"), FILES, ids=[name for name, _ in FILES])
def test_a_damaged_byte_changes_nothing_or_is_refused_by_name(
    name: str, content: Callable[[Path], Any], made: Path
) -> None:
    path = sorted(made.glob(name))[0]
    directory = made / name.split("/")[0]
    wanted, whole = content(directory), path.read_bytes()
    chosen = random.Random(name)
    refused = 0
    for at in chosen.sample(range(len(whole)), min(FLIPS, len(whole))):
        damaged = bytearray(whole)
        damaged[at] ^= 1 << chosen.randrange(8)
        path.write_bytes(damaged)
        found, said = outcome(content, directory)
        refused += bool(said)
        torn = name == "series/cases.jsonl" and at == len(whole) - 1  # that case is solved again
        assert torn or path.name in said or holds(found, wanted), (at, said)
    assert refused > min(FLIPS, len(whole)) / 4


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("run/measurements.jsonl", b'"within"', b'"outside"'),
        ("run/problems.jsonl", b'"n": ', b'"n": 1'),
        ("run/machine.json", b'"cores": ', b'"cores": 1'),
        ("run/suite.toml", b"1e-08", b"1e-07"),
        ("series/cases.jsonl", b'"bound_mm": ', b'"bound_mm": 0.0, "old": '),
        ("series/series.json", b'"cases": 6', b'"cases": 5'),
    ],
)
def test_what_still_reads_well_is_refused_by_report(name: str, old: bytes, new: bytes, made: Path) -> None:
    path = made / name
    whole = path.read_bytes()
    assert old in whole
    path.write_bytes(whole.replace(old, new, 1))
    done = harness("report", path.parent)
    assert done.exit_code == 2, done.output
    assert path.name in done.output
    assert "not what was written" in done.output


def test_what_older_versions_wrote_is_accepted(made: Path) -> None:
    """Without checksums, and new rows with them below."""
    for path in (*made.glob("*/*.jsonl"), *made.glob("*/*.json")):
        text = path.read_text()
        lines = text.splitlines(keepends=True) if path.suffix == ".jsonl" else [text]
        path.write_text("".join(json.dumps(checksums.parsed(line)) + "\n" for line in lines))
        assert checksums.CRC + '"' not in path.read_text().replace("gaps_crc32", "")
    rows = made / "run" / records.MEASUREMENTS
    before = records.read(rows)
    records.append(rows, before[0] | {"key": "new"})
    assert records.read(rows) == [*before, before[0] | {"key": "new"}]
    for name in ("run", "series"):
        done = harness("report", made / name)
        assert done.exit_code == 0, done.output


def test_the_checksum_is_of_the_values_not_of_their_layout() -> None:
    row = {"a": 0.1, "b": [1, None, "Ü\ud800"], "c": {"z": True, "y": 1e-300}}
    line = records.to_sealed_line(row)
    assert checksums.parsed(line) == row
    assert checksums.parsed(json.dumps(json.loads(line), indent=3, sort_keys=True)) == row
    with pytest.raises(checksums.Damaged):
        checksums.parsed(line.replace("0.1", "0.2"))
    assert checksums.sealed(checksums.sealed(row)) == checksums.sealed(row)


@pytest.mark.parametrize("content", [b"[]", b"1", b"[" * 100_000, b"\xff", b'{"machine": 3}'])
def test_a_damaged_machine_file_is_written_anew(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "machine.json").write_bytes(content)
    assert record_machine(tmp_path, {"machine": "mine", "cores": 2}) == "mine"
    assert checksums.parsed((tmp_path / "machine.json").read_bytes()) == {"machine": "mine", "cores": 2}


def test_fewer_cases_than_before_are_reported_as_that_many(made: Path) -> None:
    """The rows of the other cases stay, for a longer series."""
    out = made / "series"
    facts = store.read_series(out)
    records.replace_object(out / store.SERIES, facts | {"cases": 4})
    assert harness("report", out).exit_code == 0
    assert "4 of 4 cases solved" in (out / "report" / "report.md").read_text()
