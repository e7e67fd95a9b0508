"""Runs among faults: whatever befalls the solvers, the disk or the harness, no finished row is lost."""

import contextlib
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from io import StringIO
from itertools import count
from pathlib import Path
from typing import Any

import psutil
import pytest
import tiny
from rich.console import Console

from harness.measurement import monitored
from harness.measurement import row as rows_module
from harness.measurement.run import run
from harness.planning.suite import read_suite
from harness.results import records

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]

#: What a solver may do beside what test_measure.py has, and what is said of it.
FAULTS = {
    **dict.fromkeys(("hang", "stop_itself", "fork_on_and_on"), "time_limit"),
    **dict.fromkeys(("kill_itself", "abort", "close_everything"), "crashed"),
    **{"recurse": "failed", "write_everywhere": "iteration_limit"},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("faults")


@pytest.fixture(autouse=True)
def _cache(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIVETBENCH_CACHE", str(folder / "cache"))


def suite_of(folder: Path, *faults: str, **keys: Any) -> Path:
    """A suite with one measurement a fault, in their order."""
    entry = """
    [[solver]]
    name = "faulty"
    variant = "{0} {1}"
    options = {{fault = "{1}"}}
    time_limit_s = {2}
    """
    limits = [0.5 if FAULTS.get(fault) == "time_limit" else 50.0 for fault in faults]
    text = "".join(entry.format(k, *line) for k, line in enumerate(zip(faults, limits, strict=True)))
    path = tiny.write_suite(folder, text, plugin="faulty.py", **keys)
    (folder / "faulty.py").write_text(tiny.FAULTY)
    return path


def rows_of(directory: Path) -> list[dict[str, Any]]:
    return records.read(directory / records.MEASUREMENTS)


def quietly(suite: Path, directory: Path) -> int:
    return run(read_suite(str(suite)), directory, Console(file=StringIO()))


def command(suite: Path, directory: Path) -> list[str]:
    return [sys.executable, "-m", "harness", "run", str(suite), "--out", str(directory)]


def wait_for(condition: Callable[[], Any]) -> Any:
    deadline = time.monotonic() + 60
    while not (found := condition()):
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.01)
    return found


def test_a_run_goes_through_every_fault_of_its_solvers(folder: Path) -> None:
    suite = suite_of(folder / "all", *FAULTS, memory_limit_mib=300)
    out = folder / "all" / "out"
    before = set(psutil.pids())
    quietly(suite, out)
    statuses = {row["variant"].split()[1]: row["status"] for row in rows_of(out)}
    assert statuses == FAULTS
    assert all(row["message"] for row in rows_of(out) if row["status"] in ("crashed", "failed"))
    wait_for(lambda: not [p for p in set(psutil.pids()) - before if is_ours(p, folder)])
    lines = (out / records.MEASUREMENTS).read_bytes()
    quietly(suite, out)
    assert (out / records.MEASUREMENTS).read_bytes() == lines


def is_ours(pid: int, folder: Path) -> bool:
    """Whether a process is a worker, or the child of one, of this test."""
    try:
        process = psutil.Process(pid)
        ours = process.environ().get("RIVETBENCH_CACHE") == str(folder / "cache")
        return ours and process.status() != psutil.STATUS_ZOMBIE
    except psutil.Error:
        return False


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


def workers_of(driver: int) -> list[psutil.Process]:
    """The workers among a driver's children, some of which may end while they are looked at."""
    found = []
    for child in psutil.Process(driver).children():
        with contextlib.suppress(psutil.NoSuchProcess):
            if "measure_here" in child.cmdline():
                found.append(child)
    return found


def test_a_worker_that_something_else_kills_is_a_row(folder: Path) -> None:
    suite = suite_of(folder / "worker", "sleep", "gives_up")
    out = folder / "worker" / "out"
    going = subprocess.Popen(command(suite, out), cwd=ROOT, stdout=subprocess.DEVNULL)
    worker = wait_for(lambda: workers_of(going.pid))[0]
    worker.send_signal(signal.SIGKILL)
    assert going.wait(60) == 3  # nothing could be judged
    assert [row["status"] for row in rows_of(out)] == ["crashed", "iteration_limit"]


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
