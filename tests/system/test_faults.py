"""Runs among faults: whatever befalls the solvers, the disk or the harness, no finished row is lost."""

import os
import resource
import subprocess
import sys
import time
from datetime import UTC, datetime, timedelta
from io import StringIO
from itertools import count
from pathlib import Path
from typing import Any

import pytest
import tiny
from rich.console import Console
from runs import rows_of, wait_for

from harness.measurement import monitored
from harness.measurement import row as rows_module
from harness.measurement.run import run
from harness.planning.suite import read_suite
from harness.results import records

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("faults")


def suite_of(folder: Path, *faults: str) -> Path:
    """A suite with one measurement a fault, in their order."""
    entry = """
    [[solver]]
    name = "faulty"
    variant = "{0} {1}"
    options = {{fault = "{1}"}}
    time_limit_s = {2}
    """
    limits = [0.5 if fault == "hang" else 50.0 for fault in faults]
    text = "".join(entry.format(k, *line) for k, line in enumerate(zip(faults, limits, strict=True)))
    path = tiny.write_suite(folder, text, plugin="faulty.py")
    (folder / "faulty.py").write_text(tiny.FAULTY)
    return path


def quietly(suite: Path, directory: Path) -> int:
    return run(read_suite(str(suite)), directory, Console(file=StringIO()))


def command(suite: Path, directory: Path) -> list[str]:
    return [sys.executable, "-m", "harness", "run", str(suite), "--out", str(directory)]


def test_a_run_killed_again_and_again_ends_with_every_row_once(folder: Path) -> None:
    suite = suite_of(folder / "killed", *["gives_up"] * 4)
    out = folder / "killed" / "out"
    rows, seen = out / records.MEASUREMENTS, b""
    for enough in (1, 2, 3):
        going = subprocess.Popen(command(suite, out), cwd=ROOT, stdout=subprocess.DEVNULL)
        wait_for(lambda: rows.exists() and rows.read_bytes().count(b"\n") >= enough)  # noqa: B023
        going.kill()
        going.wait()
        assert rows.read_bytes().startswith(seen)
        seen = rows.read_bytes()[: rows.read_bytes().rfind(b"\n") + 1]
    quietly(suite, out)
    assert rows.read_bytes().startswith(seen)
    assert [row["variant"][0] for row in rows_of(out)] == ["0", "1", "2", "3"]


def test_files_that_may_not_grow_are_said_and_resumed(folder: Path) -> None:
    """A quota by RLIMIT_FSIZE: three rows or so have room, and no compiled file, which Python cuts short."""
    out = folder / "quota" / "out"
    quietly(suite_of(folder / "quota", "gives_up"), out)
    suite = suite_of(folder / "quota", *["gives_up"] * 4)
    room = 3 * (out / records.MEASUREMENTS).stat().st_size

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        command(suite, out), cwd=ROOT, capture_output=True, text=True, preexec_fn=limited, env=environment
    )
    assert done.returncode == 2
    assert "rows already written are safe" in done.stderr
    kept = (out / records.MEASUREMENTS).read_bytes()
    assert 1 < len(rows_of(out)) < 4
    quietly(suite, out)
    assert (out / records.MEASUREMENTS).read_bytes().startswith(kept)
    assert len(rows_of(out)) == 4


def test_a_clock_that_jumps_ends_no_run_and_loses_no_row(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The wall clock leaps years either way at each look; the time limit is kept by another clock."""
    leaps = count()

    def leaping() -> float:
        return 1.7e9 + 1e8 * (-1) ** next(leaps)

    class Leaping(datetime):
        @classmethod
        def now(cls, tz: Any = None) -> datetime:
            return datetime(2000, 1, 1, tzinfo=UTC) - timedelta(days=next(leaps))

    monkeypatch.setattr(time, "time", leaping)
    monkeypatch.setattr(rows_module, "datetime", Leaping)
    assert monitored.time is time
    suite = suite_of(folder / "clock", "hang", "gives_up", "hang")
    out = folder / "clock" / "out"
    start = time.monotonic()
    quietly(suite, out)
    assert time.monotonic() - start < 60
    rows = rows_of(out)
    assert [row["status"] for row in rows] == ["time_limit", "iteration_limit", "time_limit"]
    assert [row["recorded_at"] for row in rows] == sorted((row["recorded_at"] for row in rows), reverse=True)
    lines = (out / records.MEASUREMENTS).read_bytes()
    quietly(suite, out)
    assert (out / records.MEASUREMENTS).read_bytes() == lines
