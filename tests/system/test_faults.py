"""Runs among faults: whatever befalls the solvers, the disk or the harness, no finished row is lost."""

import resource
import signal
import sys
from io import StringIO
from pathlib import Path

import pytest
import tiny_joint
from forked_processes import forked_command
from rich.console import Console
from suite_runs import rows_of, wait_for

from harness.measurement.suite_run import run
from harness.planning.suite import read_suite
from harness.results import records

pytestmark = pytest.mark.slow


def suite_of(folder: Path, rows: int) -> Path:
    """A suite of so many measurements."""
    entry = '[[solver]]\nname = "faulty"\nvariant = "{}"\noptions = {{fault = "gives_up"}}\n'
    path = tiny_joint.write_suite(folder, "".join(map(entry.format, range(rows))), plugin="faulty.py")
    (folder / "faulty.py").write_text(tiny_joint.FAULTY)
    return path


def quietly(suite: Path, directory: Path) -> int:
    return run(read_suite(str(suite)), directory, Console(file=StringIO()))


def test_a_run_killed_again_and_again_ends_with_every_row_once(tmp_path: Path) -> None:
    suite = suite_of(tmp_path, 6)
    out = tmp_path / "out"
    rows, seen = out / records.MEASUREMENTS, b""
    for enough in (1, 3):
        going = forked_command("run", suite, "--out", out)
        wait_for(lambda: rows.exists() and rows.read_bytes().count(b"\n") >= enough)  # noqa: B023
        going.send(signal.SIGKILL)
        assert going.ended()[0] == -signal.SIGKILL
        assert rows.read_bytes().startswith(seen)
        seen = rows.read_bytes()[: rows.read_bytes().rfind(b"\n") + 1]
    quietly(suite, out)
    assert rows.read_bytes().startswith(seen)
    assert [row["variant"] for row in rows_of(out)] == [str(k) for k in range(6)]


def test_files_that_may_not_grow_are_said_and_resumed(tmp_path: Path) -> None:
    """A quota by RLIMIT_FSIZE: three rows or so have room; a compiled file would be cut short."""
    out = tmp_path / "out"
    quietly(suite_of(tmp_path, 1), out)
    suite = suite_of(tmp_path, 4)
    room = 3 * (out / records.MEASUREMENTS).stat().st_size

    def limited() -> None:
        sys.dont_write_bytecode = True
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    code, said = forked_command("run", suite, "--out", out, before=limited).ended()
    assert code == 2
    assert "rows already written are safe" in said
    kept = (out / records.MEASUREMENTS).read_bytes()
    assert 1 < len(rows_of(out)) < 4
    quietly(suite, out)
    assert (out / records.MEASUREMENTS).read_bytes().startswith(kept)
    assert len(rows_of(out)) == 4
