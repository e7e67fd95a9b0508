"""The child's side of a monitored call (monitored_call.py), and how the processes that it started are ended.

The call comes pickled through stdin; events go back as JSON lines on the file descriptor that it names.
"""

import contextlib
import ctypes
import faulthandler
import io
import os
import pickle
import signal
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from harness.results.records import to_line
from harness.solving.solver_answer import InvalidAnswer, error_text
from problems.errors import InputError

TIMEOUT_S = 10.0  # for children that keep forking
LINE_BUFFERED = 1  # _IOLBF of glibc


class Events:
    """Sends events to the driver, from this process alone: a fork of it that returns here ends."""

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


def main() -> None:
    """Call the function; report its result, or its exception with a status; then wait to be killed.

    Functions registered for the exit of the process therefore never run.
    """
    die_with_driver()
    print_line_by_line()
    faulthandler.enable()
    function, job, descriptor = pickle.load(sys.stdin.buffer)
    events = Events(descriptor)
    try:
        end = function(job, events) or {}
    except InputError as error:
        faults = [asdict(fault) for fault in error.faults]
        end = {"status": "failed", "message": error_text(error), "faults": faults}
    except MemoryError as error:
        end = {"status": "memory_limit", "message": f"the solver ran out of memory: {error}"}
    except InvalidAnswer as error:
        end = {"status": error.status, "message": str(error)}
    except BaseException as error:
        end = {"status": "failed", "message": f"raised {error_text(error)}"}
    events.report(**end, ended=True)
    sys.stdin.read()
    os._exit(0)


def die_with_driver() -> None:
    """Linux: die when the driver dies, and adopt the orphans of child processes."""
    if sys.platform == "linux":
        set_death_signal, set_child_subreaper = 1, 36
        prctl = ctypes.CDLL(None).prctl
        prctl(set_death_signal, signal.SIGKILL)
        prctl(set_child_subreaper, 1)


def print_line_by_line() -> None:
    """Let Python, and C where it has glibc, pass on each line at once, so that a log survives a kill."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    with contextlib.suppress(AttributeError, ValueError):
        c = ctypes.CDLL(None)
        c.setvbuf(ctypes.c_void_p.in_dll(c, "stdout"), None, LINE_BUFFERED, 0)


def end_children(parent: int) -> None:
    """Kill the children of a stopped process until none is left.

    Their orphans become its children too, since it is a subreaper.
    """
    deadline = time.monotonic() + TIMEOUT_S
    ended: set[int] = set()  # the stopped process does not reap them, so none of their numbers is used again
    while (alive := [pid for pid in _children(parent) if pid not in ended]) and time.monotonic() < deadline:
        for child in reversed(alive):  # the youngest first, before its parent forks another
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(child, signal.SIGKILL)
        ended |= {child for child in alive if not _is_alive(child)}  # their orphans are in the next list


def _children(pid: int) -> list[int]:
    try:
        lists = [path.read_text() for path in Path(f"/proc/{pid}/task").glob("*/children")]
    except OSError:  # it has ended
        return []
    return [int(child) for text in lists for child in text.split()]


def _is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text(errors="replace").rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


if __name__ == "__main__":
    main()
