"""Directories of results and of series whose files are damaged, cut off or foreign: refused by name."""

import json
import os
import re
import shutil
import sqlite3
from contextlib import closing
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from commands import harness, wrong_usage
from strip_scene import write_strip
from suite_runs import changed
from synthetic_series import IDENTITY
from typer.testing import Result

from harness.measurement.suite_run import record_machine
from harness.planning.suite import read_written
from harness.results import records, series_file
from harness.results.row_validation import refuse_unreadable
from harness.results.schema import SERIES
from problems.errors import InputError

pytestmark = pytest.mark.slow

PUBLISHED = Path(__file__).parents[2] / "results" / "published"
CASES = 12


def instead(content: bytes) -> Any:
    return lambda path: path.write_bytes(content)


def cut(share: float) -> Any:
    return lambda path: os.truncate(path, int(share * path.stat().st_size))


def flipped(path: Path) -> None:
    """One bit of the numbers of an array: the CRC of a .npz sees it."""
    damaged = bytearray(path.read_bytes())
    damaged[damaged.index(b"x.npy") + 200] ^= 1
    path.write_bytes(damaged)


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def device(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


CUTS = [*map(cut, (0.0, 0.4, 0.99))]
NESTED = b"[" * 100_000
DAMAGES: dict[str, list[Any]] = {
    records.MEASUREMENTS: [*CUTS, pipe, instead(NESTED + b"\n")],
    "problems.jsonl": [
        *(*CUTS[1:], pipe),
        *map(instead, (NESTED + b"\n{}\n", b"{}\n", b'{"scene": 3}\n', b'{"scene": "a", "n": "many"}\n')),
    ],
    "machine.json": [*CUTS, device, *map(instead, (NESTED, b"1", b"\xff"))],
    "suite.toml": [*map(instead, (b"solver = [3]", b"[[solver]]\nname = 1", b"\xff", b"scenes = 3"))],
    "scenes/tiny.npz": [*CUTS, device, flipped],
}


@pytest.mark.parametrize(("name", "damage"), [(name, each) for name in DAMAGES for each in DAMAGES[name]])
def test_a_damaged_file_of_a_run_is_named(name: str, damage: Any, copy: Path) -> None:
    damage(copy / name)
    assert Path(name).name in wrong_usage("report", copy)


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("series")
    write_strip(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("report.writers.series_report.write", lambda directory: directory)
        assert solve_series(folder / "out").exit_code == 0
    return folder


@pytest.fixture
def series(solved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The directory of a finished series of CASES cases; its report is not drawn."""
    monkeypatch.setattr("report.writers.series_report.write", lambda directory: directory)
    return Path(shutil.copytree(solved, tmp_path / "copy")) / "out"


def solve_series(out: Path) -> Result:
    asked = ("--cases", CASES, "--threads", 1, "--check", 0, "--out", out)
    return harness("series", out.parent / "strip.toml", *asked)


@pytest.mark.parametrize(
    "damage", [*CUTS, pipe, device, *map(instead, (b"[]", b"SQLite format 3\0", b"\xff" * 5000))]
)
def test_a_file_that_holds_no_series_is_named(damage: Any, series: Path) -> None:
    damage(series / SERIES)
    assert SERIES in wrong_usage("report", series)
    if damage in (CUTS[1], pipe):
        assert solve_series(series).exit_code == 2


@pytest.mark.parametrize(
    "statement",
    [
        *(
            f"UPDATE facts SET value = {value} WHERE name = 'series'"
            for value in ("'[]'", """'{"identity": 1}'""", "1", "CAST(x'ff' AS TEXT)")
        ),
        *(
            f"UPDATE facts SET value = {value} WHERE name = 'contacts'"
            for value in ("1", "'a'", "x''", "x'00'", "substr(value, 1, 200)")
        ),
        "DELETE FROM facts WHERE name = 'series'",
        "DELETE FROM facts WHERE name = 'contacts'",
        "UPDATE cases SET gap = NULL WHERE number = 3",
        "UPDATE cases SET gap = substr(gap, 5) WHERE number = 3",
        "UPDATE cases SET gap = printf('%180s', 'a') WHERE number = 3",
        *(
            f"UPDATE cases SET row = {row} WHERE number = 3"
            for row in ("'[]'", "'1'", """'{"case": 3}'""", "x'ff'", "CAST(x'ff' AS TEXT)")
        ),
        "DROP TABLE cases",
    ],
)
def test_a_series_that_lacks_something_is_not_reported_on(statement: str, series: Path) -> None:
    with series_file.connected(series) as connection:
        connection.execute(statement)
    assert SERIES in wrong_usage("report", series)
    if "SET gap" in statement:
        with pytest.raises(InputError, match="gaps of case 3"):
            series_file.StoredGaps(series, 45)[[2, 3]]
    if re.search(r"'\[\]'|value = 1 |NULL|DROP", statement):  # each kind of damage once
        assert solve_series(series).exit_code in (0, 2)


def test_a_series_whose_damage_sqlite_cannot_spell_is_named(tmp_path: Path) -> None:
    """Its message quotes bytes that are no UTF-8."""
    series_file.write_fact(tmp_path, "other", "")
    with closing(sqlite3.connect(tmp_path / SERIES)) as connection, connection:
        connection.execute("PRAGMA writable_schema = ON")
        connection.execute("UPDATE sqlite_master SET name = CAST(X'FD90' AS TEXT) WHERE type = 'index'")
        connection.execute("DELETE FROM sqlite_master WHERE name = 'facts'")
    with pytest.raises(InputError, match=rf"{SERIES}: content"):
        series_file.read_facts(tmp_path)


def test_a_reader_is_waited_for_and_then_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that another program reads is not damaged: nobody is told to delete it."""
    facts = {"identity": IDENTITY, "scene": "a", "title": "a", "machine": "a", "cases": 1, "threads": 1}
    series_file.write_fact(tmp_path, "series", json.dumps(facts))
    row = {"case": 0, "verdict": "no_answer"}
    with closing(sqlite3.connect(tmp_path / SERIES)) as reader:
        reader.execute("BEGIN")
        assert reader.execute("SELECT count(*) FROM cases").fetchone() == (0,)
        seconds = count()

        def clock() -> int:
            if (now := next(seconds)) == 3:
                reader.rollback()
            return now

        monkeypatch.setattr(series_file, "RETRY_S", 0)
        monkeypatch.setattr(series_file, "time", SimpleNamespace(monotonic=clock))
        with monkeypatch.context() as patch:
            patch.setattr(series_file, "WAIT_S", 0)
            with pytest.raises(OSError, match=rf"{SERIES}: another program keeps it open"):
                series_file.append(tmp_path, [(row, None)])
        series_file.append(tmp_path, [(row, None)])
    assert list(series_file.rows(tmp_path)) == [row]


@pytest.mark.usefixtures("blank_pictures")
def test_fewer_cases_are_reported_as_that_many(solved: Path, tmp_path: Path) -> None:
    """The rows of the other cases stay, for a longer series."""
    series = Path(shutil.copytree(solved, tmp_path / "copy")) / "out"
    facts = series_file.read_facts(series) or {}
    series_file.write_fact(series, "series", json.dumps(facts | {"cases": 4}))
    assert harness("report", series).exit_code == 0
    assert re.search(r"solved +\| 4 of 4 cases", (series / "report" / "report.md").read_text())


@pytest.mark.parametrize(
    ("name", "value"),
    [*((name, None) for name in ("key", "verdict", "tolerance", "repeat")), ("time_limit_s", "a")],
)
def test_a_run_names_the_row_that_it_cannot_continue(name: str, value: Any, copy: Path) -> None:
    changed(copy, **{name: value})
    assert f"measurements.jsonl: line 1: {name}" in wrong_usage("run", copy, "--out", copy)


def test_a_run_names_the_damaged_file_of_another_machine(copy: Path) -> None:
    """Which it does not write anew, as it does its own; its report would lack that machine."""
    (copy / "machine-1.json").write_bytes(b"{")
    assert "machine-1.json: content" in wrong_usage("run", copy, "--out", copy)


@pytest.mark.usefixtures("blank_pictures")
def test_text_among_the_arrays_of_a_scene_is_left_out(copy: Path) -> None:
    (path,) = (copy / "scenes").iterdir()
    np.savez(path, **{name: values.astype(str) for name, values in records.read_arrays(path).items()})
    assert harness("report", copy).exit_code == 0


@pytest.mark.parametrize("path", sorted(PUBLISHED.glob("*/suite.toml")), ids=lambda path: path.parent.name)
def test_what_is_published_can_be_read(path: Path) -> None:
    """Nothing that is published is taken for damage."""
    assert read_written(path).solver
    refuse_unreadable(path.parent)


@pytest.mark.parametrize("content", [b"[]", NESTED, b"\xff", b'{"machine": 3}'])
def test_a_damaged_machine_file_is_written_anew(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "machine.json").write_bytes(content)
    assert record_machine(tmp_path, {"machine": "mine", "cores": 2}) == "mine"
    assert json.loads((tmp_path / "machine.json").read_text()) == {"machine": "mine", "cores": 2}


def test_a_machine_takes_the_file_of_no_other(tmp_path: Path) -> None:
    """Also after a file was deleted, whose number is free."""
    for name in ("a", "b", "c"):
        record_machine(tmp_path, {"machine": name})
    (tmp_path / "machine-1.json").unlink()
    record_machine(tmp_path, {"machine": "d"})
    record_machine(tmp_path, {"machine": "e"})
    names = {json.loads(path.read_text())["machine"] for path in tmp_path.glob("machine*.json")}
    assert names == {"b", "c", "d", "e"}
