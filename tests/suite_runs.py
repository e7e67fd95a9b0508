"""Runs of a suite: what they say, their rows, answers that were moved, and the processes that they leave."""

import time
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from rich.console import Console

from harness.results import records, series_file
from harness.results.records import Row
from harness.verification.gate import gate, show
from problems.errors import InputError


def said_by(call: Any, *arguments: Any) -> tuple[int, str]:
    """The exit code, and what the console that is the last argument shows."""
    shown = StringIO()
    code = call(*arguments, Console(file=shown, width=200))
    return code, shown.getvalue()


def gated(directory: Path) -> tuple[int, str]:
    """The exit code of the gate, and what its command shows."""
    return said_by(lambda console: show(gate(directory), console))


def rows_of(directory: Path) -> list[Row]:
    return records.read(directory / records.MEASUREMENTS)


def changed(directory: Path, **figures: Any) -> Path:
    """Every row with these figures."""
    records.rewrite(directory / records.MEASUREMENTS, [row | figures for row in rows_of(directory)])
    return directory


def moved(answer: Path, shift: float, index: int = 7) -> None:
    """One displacement of a saved answer is off by `shift`, mm."""
    with np.load(answer) as saved:
        x, lam = saved["x"].copy(), saved["lam"]
    x[index] += shift
    np.savez(answer, x=x, lam=lam)


def series_rows(directory: Path) -> list[Row]:
    """The rows of a series, if its tables are there yet."""
    try:
        return list(series_file.rows(directory))
    except InputError:
        return []


def wait_for(condition: Any) -> Any:
    """What the condition gives once that is true."""
    deadline = time.monotonic() + 60
    while not (found := condition()):
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.01)
    return found


def is_alive(process: psutil.Process) -> bool:
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def processes(cache: Path) -> list[psutil.Process]:
    """Those that were started with this cache, which marks a test's own, and forks of this process, which no
    variable marks; a fork whose parent has ended is not among them.
    """
    living, here = [], psutil.Process()
    descendants = here.children(recursive=True)
    for process in psutil.process_iter():
        try:
            fork = process in descendants and process.cmdline() == here.cmdline()
            ours = fork or process.environ().get("RIVETBENCH_CACHE") == str(cache)
            if ours and is_alive(process):
                living.append(process)
        except psutil.Error:
            continue
    return living


def all_end(cache: Path) -> bool:
    """Whether no process is left; the killed ones take a moment."""
    deadline = time.monotonic() + 30
    while processes(cache) and time.monotonic() < deadline:
        time.sleep(0.05)
    return not processes(cache)
