"""Linux: ends the children of a process, however fast they fork."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from pathlib import Path

TIMEOUT_S = 10.0  # for children that keep forking


def end_children(pid: int) -> None:
    """Kill the children of a stopped process until all that it has were dead before they were listed.

    Their orphans become its children too, since it is a subreaper: so one that forks and dies before it is
    killed adds its orphan to the next list. The dead stay in the list, since nobody waits for them.
    """
    deadline = time.monotonic() + TIMEOUT_S
    ended: set[int] = set()
    while (children := [c for c in _children(pid) if c not in ended]) and time.monotonic() < deadline:
        for child in reversed(children):  # the youngest first, before its parent forks another
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(child, signal.SIGKILL)
        ended.update(child for child in children if not _is_alive(child))


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
