"""Measuring processes forked from that of the tests, which has imported all they need: a start takes a
fiftieth of its time. What starts them is unchanged, and so are their limits and their ends.
"""

import os
import subprocess
import sys
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, NoReturn

import pytest

from harness.measurement import child_process, monitored_call

LEAST_MIB = 8192


class Forked:
    """The part of subprocess.Popen that a monitored call uses."""

    def __init__(
        self, command: Sequence[str], *, env: dict[str, str], pass_fds: Sequence[int], **_: Any
    ) -> None:
        job, self_job = os.pipe()
        self_stdout, stdout = os.pipe()
        self_stderr, stderr = os.pipe()
        self.returncode: int | None = None
        self.pid = os.fork()
        if self.pid == 0:
            _become_child(env, job, stdout, stderr, *pass_fds)
        for child_end in (job, stdout, stderr):
            os.close(child_end)
        self.stdin = os.fdopen(self_job, "wb")
        self.stdout = os.fdopen(self_stdout, "rb", buffering=0)
        self.stderr = os.fdopen(self_stderr, "rb", buffering=0)

    def poll(self, options: int = os.WNOHANG) -> int | None:
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, options)
            self.returncode = os.waitstatus_to_exitcode(status) if pid else None
        return self.returncode

    def wait(self) -> int | None:
        return self.poll(options=0)


def _become_child(env: dict[str, str], job: int, stdout: int, stderr: int, events: int) -> NoReturn:
    try:
        os.setsid()
        os.dup2(job, 0)
        os.dup2(stdout, 1)
        os.dup2(stderr, 2)
        for low, high in ((3, events), (events + 1, 1024)):
            os.closerange(low, high)
        sys.stdin, sys.stdout, sys.stderr = (os.fdopen(k, "rw"[k > 0]) for k in range(3))
        os.environ.clear()
        os.environ.update(env)
        child_process.main()
    finally:
        os._exit(1)


def fork_measuring_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """From here on, unless they need another interpreter.

    They hold what the process of the tests holds, which grows from test to test: a test whose limit on memory
    is lower than `LEAST_MIB` starts them (mark `starts`).
    """
    limit = monitored_call.Monitored._exceeded

    def exceeded(self: monitored_call.Monitored) -> Any:
        assert self.memory_limit_mib >= LEAST_MIB, "a forked process holds the tests' memory: mark `starts`"
        return limit(self)

    monkeypatch.setattr(monitored_call.Monitored, "_exceeded", exceeded)

    def start(command: Sequence[str], **options: Any) -> Any:
        kind = Forked if command[0] == sys.executable else subprocess.Popen
        return kind(command, **options)

    made = SimpleNamespace(Popen=start, PIPE=subprocess.PIPE, DEVNULL=subprocess.DEVNULL)
    monkeypatch.setattr(monitored_call, "subprocess", made)
