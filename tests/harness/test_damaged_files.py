"""A file of a results or series directory that was cut off, or is none of ours, is refused by name."""

import json
import os
import re
import shutil
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tiny
from rich.console import Console
from strip import write_strip
from typer.testing import CliRunner

from harness.cli.app import app
from harness.measurement.run import record_machine, run
from harness.planning.suite import read_suite
from harness.results import records, series_file
from harness.results.kinds import refuse_unreadable
from harness.results.schema import SERIES
from harness.verification.reference_problem import reference_problem
from problems.errors import InputError

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def directories(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`run`, a directory of results, and `series`."""
    folder = tmp_path_factory.mktemp("whole")
    text = '[[solver]]\nname = "exact"\nforms = ["dual"]\n'
    suite = read_suite(str(tiny.write_suite(folder, text, tolerances=[1e-6, 1e-8])))
    assert run(suite, folder / "run", Console(file=StringIO())) == 0
    write_strip(folder)
    words = ["series", folder / "strip.toml", "--cases", 6, "--check", 0, "--out", folder / "series"]
    assert CliRunner().invoke(app, list(map(str, words))).exit_code == 0
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
    return records.parsed((directory / "machine.json").read_bytes())


def series_of(directory: Path) -> Any:
    series_file.refuse_damaged(directory)
    gaps = series_file.StoredGaps(directory, 45)[range(6)]
    return series_file.read_facts(directory), list(series_file.rows(directory)), gaps


FILES: list[tuple[str, Callable[[Path], Any]]] = [
    (f"run/{records.MEASUREMENTS}", rows_of),
    ("run/problems.jsonl", rows_of),
    ("run/machine.json", machine_of),
    ("run/scenes/*.npz", arrays_of),
    ("run/answers/*.npz", answer_of),
    (f"series/{SERIES}", series_of),
]


def outcome(content: Callable[[Path], Any], directory: Path) -> tuple[Any, str]:
    """What is read, or what is said."""
    try:
        return content(directory), ""
    except InputError as error:
        return None, str(error)


@pytest.mark.parametrize("kept", [0.0, 0.4, 0.99])  # half of two rows may be one row
@pytest.mark.parametrize(("name", "content"), FILES, ids=[name for name, _ in FILES])
def test_a_file_that_was_cut_off_is_refused_by_name(
    name: str, content: Callable[[Path], Any], kept: float, made: Path
) -> None:
    path = sorted(made.glob(name))[0]
    directory = made / name.split("/")[0]
    content(directory)
    os.truncate(path, int(kept * path.stat().st_size))
    found, said = outcome(content, directory)
    if kept or path.suffix != ".jsonl":
        assert path.name in said
    else:
        assert not found or "no row yet" in said or not found[1]  # as before the first row


@pytest.mark.parametrize("name", ["run/scenes/*.npz", "run/answers/*.npz"])
def test_a_damaged_byte_of_an_array_is_seen(name: str, made: Path) -> None:
    """By the CRC of the .npz."""
    path = sorted(made.glob(name))[0]
    content = bytearray(path.read_bytes())
    content[content.index(records.read_arrays(path)["x"].tobytes()) + 3] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"not a \.npz file"):
        records.read_arrays(path)


def test_what_older_versions_wrote_is_accepted(made: Path) -> None:
    """With checksums of rows, objects and the suite."""
    rows = made / "run" / records.MEASUREMENTS
    before = records.read(rows)
    rows.write_text("".join(records.to_line(row | {"crc32": "01234567"}) + "\n" for row in before))
    suite, machine = made / "run" / "suite.toml", made / "run" / "machine.json"
    suite.write_text("# crc32 01234567 of the lines below\n\n" + suite.read_text())
    machine.write_text(machine.read_text().replace("{", '{"crc32": "01234567",', 1))
    assert records.read(rows) == before
    assert CliRunner().invoke(app, ["report", str(made / "run")]).exit_code == 0


@pytest.mark.parametrize("content", [b"[]", b"1", b"[" * 100_000, b"\xff", b'{"machine": 3}'])
def test_a_damaged_machine_file_is_written_anew(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "machine.json").write_bytes(content)
    assert record_machine(tmp_path, {"machine": "mine", "cores": 2}) == "mine"
    assert json.loads((tmp_path / "machine.json").read_text()) == {"machine": "mine", "cores": 2}


def test_fewer_cases_than_before_are_reported_as_that_many(made: Path) -> None:
    """The rows of the other cases stay, for a longer series."""
    out = made / "series"
    facts = series_file.read_facts(out) or {}
    series_file.write_fact(out, "series", json.dumps(facts | {"cases": 4}))
    assert CliRunner().invoke(app, ["report", str(out)]).exit_code == 0
    assert re.search(r"solved +\| 4 of 4 cases", (out / "report" / "report.md").read_text())
