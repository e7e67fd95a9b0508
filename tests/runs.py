"""Runs of a suite in this process: what they say, their rows, answers that were moved."""

import time
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from harness.results import records, series_file
from harness.results.records import Row
from problems.errors import InputError


def said_by(call: Any, *arguments: Any) -> tuple[int, str]:
    """The exit code, and what the console that is the last argument shows."""
    shown = StringIO()
    code = call(*arguments, Console(file=shown, width=200))
    return code, shown.getvalue()


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
