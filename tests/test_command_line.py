"""The command line starts fast: help needs none of the libraries that compute or draw."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SHOW = """
import sys
from harness.cli.app import main
try:
    main()
finally:
    print(*{name.partition(".")[0] for name in sys.modules}, file=sys.stderr)
"""


def test_help_imports_nothing_that_is_slow() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SHOW, "--help"],
        cwd=Path(__file__).parents[1],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "Exit codes" in done.stdout
    slow = {"numpy", "scipy", "pandas", "matplotlib", "pydantic", "rich", "problems", "solvers", "report"}
    assert not slow & set(done.stderr.split())
