"""Linux: ends the children of a process, however fast they fork on."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from pathlib import Path

LAST_FORKS_S = 10.0  # for killing what forks on


def end_children(pid: int) -> None:
    """Kill the children of a stopped process until none is left.

    Orphans come to it too, since it is a subreaper.
    """
    deadline = time.monotonic() + LAST_FORKS_S
    living = True
    while living and time.monotonic() < deadline:
        children = _children(pid)
        for child in reversed(children):  # the youngest first: its parent has no time for another
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(child, signal.SIGKILL)
        living = any(map(_is_living, children))


def _children(pid: int) -> list[int]:
    try:
        lists = [path.read_text() for path in Path(f"/proc/{pid}/task").glob("*/children")]
    except OSError:  # it is gone
        return []
    return [int(child) for text in lists for child in text.split()]


def _is_living(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False
