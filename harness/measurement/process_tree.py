"""Linux: ends the children of a process, however fast they fork."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from pathlib import Path

TIMEOUT_S = 10.0  # for children that keep forking


def end_children(pid: int) -> None:
    """Kill the children of a stopped process until none is left.

    Their orphans become its children too, since it is a subreaper.
    """
    deadline = time.monotonic() + TIMEOUT_S
    alive = True
    while alive and time.monotonic() < deadline:
        children = _children(pid)
        for child in reversed(children):  # the youngest first, before its parent forks another
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(child, signal.SIGKILL)
        alive = any(map(_is_alive, children))


def _children(pid: int) -> list[int]:
    try:
        lists = [path.read_text() for path in Path(f"/proc/{pid}/task").glob("*/children")]
    except OSError:  # it has ended
        return []
    return [int(child) for text in lists for child in text.split()]


def _is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False
