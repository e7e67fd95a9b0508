"""The child's side of a monitored call (monitored.py): its job, its events and its end.

The call comes pickled through stdin; events go back as JSON lines on the file descriptor that it names.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import pickle
import signal
import sys
from dataclasses import asdict
from typing import Any

from harness.results.records import to_line
from harness.solving.answers import InvalidAnswer, error_text
from problems.errors import InputError


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


def main() -> None:
    """Call the function; report what it returns, or its exception with a status; then wait to be killed, so
    that what is registered for the exit never runs.
    """
    die_with_driver()
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


if __name__ == "__main__":
    main()
