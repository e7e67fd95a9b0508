"""A finished run of the tiny joint, made once per process: two rows of the plug-in `exact`."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import pytest
import tiny
from rich.console import Console

from harness.measurement.run import run
from harness.planning.suite import read_suite


def finished_run(factory: pytest.TempPathFactory) -> Path:
    """Its directory, which nobody may change: tests take a copy."""
    folder = factory.getbasetemp() / "finished-run"
    if not (folder / "finished").is_dir():
        suite = read_suite(str(tiny.write_suite(folder, tolerances=[1e-6, 1e-8])))
        assert run(suite, folder / "finished", Console(file=StringIO())) == 0
    return folder / "finished"
