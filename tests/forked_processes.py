"""Measuring processes, and commands of the project, forked from the process of the tests, which has imported
all they need: a start takes a fiftieth of its time. What starts them is unchanged, and so are their limits
and their ends.
"""

import gc
import os
import signal
import subprocess
import sys
import traceback
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, NoReturn

import pytest

from harness.cli import app
from harness.measurement import child_process, monitored_call

LEAST_MIB = 8192


class Forked:
    """A call in a fork, with the part of subprocess.Popen that is used of it."""

    def __init__(self, call: Callable[[], None], env: dict[str, str], *kept: int) -> None:
        job, self_job = os.pipe()
        self_stdout, stdout = os.pipe()
        self_stderr, stderr = os.pipe()
        self.returncode: int | None = None
        self.pid = os.fork()
        if self.pid == 0:
            _become_child(call, env, (job, stdout, stderr), kept)
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

    def send(self, sent: int) -> None:
        os.kill(self.pid, sent)

    def ended(self) -> tuple[int | None, str]:
        """Its exit code, and what it has said on stderr: little, or it waits for a reader."""
        with self.stdin, self.stdout, self.stderr:
            return self.wait(), self.stderr.read().decode()


def _become_child(
    call: Callable[[], None], env: dict[str, str], streams: Sequence[int], kept: Sequence[int]
) -> NoReturn:
    code = 1
    try:
        os.setsid()
        for k, stream in enumerate(streams):
            os.dup2(stream, k)
        for low, high in zip((3, *(k + 1 for k in kept)), (*kept, 1024), strict=True):
            os.closerange(low, high)
        sys.stdin, sys.stdout, sys.stderr = (os.fdopen(k, "rw"[k > 0], closefd=False) for k in range(3))
        os.environ.clear()
        os.environ.update(env)
        call()
    except SystemExit as end:
        code = int(end.code or 0)
    except BaseException:
        traceback.print_exc()
    finally:
        try:
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(code)


def forked_command(*words: object, before: Callable[[], object] = lambda: None) -> Forked:
    """`python -m harness`; not for tests that take `cluster`. before : called in the child."""

    def call() -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # as in a terminal
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        gc.callbacks.clear()  # those of hypothesis: an interrupt in one of them would be lost
        sys.argv[1:] = map(str, words)
        before()
        app.main()

    return Forked(call, dict(os.environ))


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

    def start(command: Sequence[str], *, env: dict[str, str], pass_fds: Sequence[int], **options: Any) -> Any:
        if command[0] == sys.executable:
            return Forked(child_process.main, env, *pass_fds)
        return subprocess.Popen(command, env=env, pass_fds=pass_fds, **options)

    made = SimpleNamespace(Popen=start, PIPE=subprocess.PIPE, DEVNULL=subprocess.DEVNULL)
    monkeypatch.setattr(monitored_call, "subprocess", made)
