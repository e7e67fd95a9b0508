"""The code that runs: the project's commit, or the installed version."""

from __future__ import annotations

import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

ROOT = Path(__file__).parents[2]


@cache
def commit() -> tuple[str, bool | None]:
    """The commit, 40 digits, and whether the tree has no changes; without a repository the installed
    version's text and None.
    """
    try:
        head = _git("rev-parse", "HEAD")
        top = Path(_git("rev-parse", "--show-toplevel")).resolve()
        if top == ROOT.resolve():
            return head, not _git("status", "--porcelain")
    except (OSError, subprocess.CalledProcessError):
        pass
    try:
        return version("rivetbench"), None
    except PackageNotFoundError:
        return "unknown", None


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()
