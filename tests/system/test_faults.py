"""Runs among faults: whatever befalls the solvers, the disk or the harness, no finished row is lost."""

import os
import resource
import subprocess
import sys
from io import StringIO
from pathlib import Path

import pytest
import tiny_joint
from rich.console import Console
from suite_runs import rows_of, wait_for

from harness.measurement.suite_run import run
from harness.planning.suite import read_suite
from harness.results import records

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


def suite_of(folder: Path, rows: int) -> Path:
    """A suite of so many measurements."""
    entry = '[[solver]]\nname = "faulty"\nvariant = "{}"\noptions = {{fault = "gives_up"}}\n'
    path = tiny_joint.write_suite(folder, "".join(map(entry.format, range(rows))), plugin="faulty.py")
    (folder / "faulty.py").write_text(tiny_joint.FAULTY)
    return path


def quietly(suite: Path, directory: Path) -> int:
    return run(read_suite(str(suite)), directory, Console(file=StringIO()))


def command(suite: Path, directory: Path) -> list[str]:
    return [sys.executable, "-m", "harness", "run", str(suite), "--out", str(directory)]


def test_a_run_killed_again_and_again_ends_with_every_row_once(tmp_path: Path) -> None:
    suite = suite_of(tmp_path, 4)
    out = tmp_path / "out"
    rows, seen = out / records.MEASUREMENTS, b""
    for enough in (1, 3):
        going = subprocess.Popen(command(suite, out), cwd=ROOT, stdout=subprocess.DEVNULL)
        wait_for(lambda: rows.exists() and rows.read_bytes().count(b"\n") >= enough)  # noqa: B023
        going.kill()
        going.wait()
        assert rows.read_bytes().startswith(seen)
        seen = rows.read_bytes()[: rows.read_bytes().rfind(b"\n") + 1]
    quietly(suite, out)
    assert rows.read_bytes().startswith(seen)
    assert [row["variant"] for row in rows_of(out)] == ["0", "1", "2", "3"]


def test_files_that_may_not_grow_are_said_and_resumed(tmp_path: Path) -> None:
    """A quota by RLIMIT_FSIZE: three rows or so have room, and no compiled file, which Python cuts short."""
    out = tmp_path / "out"
    quietly(suite_of(tmp_path, 1), out)
    suite = suite_of(tmp_path, 4)
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
