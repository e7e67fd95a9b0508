"""The child's side of a process under limits (limited.py): its job, its events and its end.

The job is the first line of stdin; events go back as JSON lines on the file descriptor that the job names.
"""

from __future__ import annotations

import ctypes
import faulthandler
import json
import os
import signal
import sys
from typing import Any

from harness.results.records import Row, to_line


class Events:
    """What goes back to the driver, from this process alone: a fork that returns here ends."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        self.process = os.getpid()

    def end_fork(self) -> None:
        """End this process if the user's code forked it."""
        if os.getpid() != self.process:
            os._exit(0)

    def report(self, **event: Any) -> None:
        self.end_fork()
        os.write(self.descriptor, to_line(event).encode(errors="backslashreplace") + b"\n")


def receive() -> tuple[Row, Events]:
    """The job, and where its events go. Call it before any code of a user is imported."""
    job = json.loads(sys.stdin.readline())
    die_with_driver()
    faulthandler.enable()
    return job, Events(job["events"])


def await_end() -> None:
    """Wait to be killed; what is registered for the exit never runs."""
    sys.stdin.read()
    os._exit(0)


def die_with_driver() -> None:
    """Linux: die when the driver dies, and adopt the orphans of child processes."""
    if sys.platform == "linux":
        set_death_signal, set_child_subreaper = 1, 36
        prctl = ctypes.CDLL(None).prctl
        prctl(set_death_signal, signal.SIGKILL)
        prctl(set_child_subreaper, 1)
