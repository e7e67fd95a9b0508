"""What is installed: every file of the packages that is not code."""

from __future__ import annotations

import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[1]
SUFFIXES = {".toml", ".j2", ".js", ".css", ".csv"}


def test_every_file_beside_the_code_is_in_a_package_that_is_installed() -> None:
    """The build takes whole folders, and leaves out what git ignores: no data may be ignored."""
    folders = ["harness", "problems", "report"]
    data = [path for folder in folders for path in (ROOT / folder).rglob("*.*") if path.suffix in SUFFIXES]
    assert {path.suffix for path in data} == SUFFIXES
    names = "\n".join(str(path.relative_to(ROOT)) for path in data)
    ignored = subprocess.run(
        ["git", "check-ignore", "--stdin"], cwd=ROOT, input=names, capture_output=True, text=True
    )
    assert ignored.stdout == ""
