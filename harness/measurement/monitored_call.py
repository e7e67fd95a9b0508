"""Calls a function in a process of its own, and watches its time, its memory and its end from outside.

Whatever the process does (hang, crash, exhaust memory, fork, print without end), its end is an event, and
none of its processes survives.
"""

import contextlib
import json
import os
import pickle
import selectors
import signal
import site
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Self

import psutil

from harness.results.records import Row

from .child_process import end_children

#: As Python names it, links not resolved: so begin the paths that processes print.
ROOT = Path(__file__).parents[2]
POLL_S = 0.05
STDERR_TAIL = 2000  # bytes
LOG_END = 2**16  # bytes: of what it prints, the beginning and the end are kept
CHUNK = 2**16  # bytes
LONGEST_EVENT = 2**24  # bytes
FINAL_READS = 64  # chunks of what a dead process had written
SCAN_S = 0.5  # between two searches for processes that it forked

THREAD_VARIABLES = (
    *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS"),
    *("VECLIB_MAXIMUM_THREADS", "NUMEXPR_NUM_THREADS", "RAYON_NUM_THREADS"),
)
TRIM = "MALLOC_TRIM_THRESHOLD_"  # as Dask sets it, an array's memory is given back and fetched anew each time


def environment(threads: int) -> dict[str, str]:
    """The environment variables of a worker: the thread counts, and where these packages are."""
    paths = [os.environ["PYTHONPATH"]] if os.environ.get("PYTHONPATH") else []
    if str(ROOT) not in (*site.getsitepackages(), site.getusersitepackages()):
        paths.insert(0, str(ROOT))
    count = dict.fromkeys(THREAD_VARIABLES, str(threads))
    inherited = {name: value for name, value in os.environ.items() if name != TRIM}
    return {**inherited, **count, "OMP_DYNAMIC": "FALSE", "PYTHONPATH": os.pathsep.join(paths)}


class Monitored:
    """A running call, as a context: on leaving it, all its processes are dead. Iterate for its events.

    Parameters
    ----------
    function : of a module; called in the child (child_process.py) with `job` and an `Events`.
    job : anything that can be pickled. threads : for linear algebra.
    phases : the limit on each phase, s; an event with `phase` starts the next one, with `times` times that
        limit.
    python : the interpreter (environments.py).
    """

    def __init__(
        self,
        function: Callable[[Any, Any], Row | None],
        job: Any,
        threads: int,
        phases: Mapping[str, float],
        memory_limit_mib: float,
        python: str = sys.executable,
    ) -> None:
        self.phases, self.memory_limit_mib = phases, memory_limit_mib
        self.arrived: list[Row] = []
        self.pending = b""
        self.stderr = self.log_start = self.log_rest = b""
        self.log_cut = 0  # bytes between these
        self.peak_mib = 0.0
        self.descendants: set[psutil.Process] = set()
        self.phase, self.limit_s = next(iter(phases.items()))
        self.phase_started = self.checked_at = self.scanned_at = time.monotonic()
        events, events_of_child = os.pipe()
        try:
            self.process = subprocess.Popen(
                [python, "-P", "-m", "harness.measurement.child_process", function.__qualname__],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env=environment(threads),
                pass_fds=(events_of_child,),
                start_new_session=True,
            )
        finally:
            os.close(events_of_child)
        self.root = psutil.Process(self.process.pid)
        self.events = open(events, "rb", buffering=0)  # noqa: SIM115
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        assert self.process.stderr is not None
        self.selector = selectors.DefaultSelector()
        outputs = (self.process.stdout, self._take_printed), (self.process.stderr, self._take_stderr)
        for stream, take in ((self.events, self._take_events), *outputs):
            os.set_blocking(stream.fileno(), False)
            self.selector.register(stream, selectors.EVENT_READ, take)
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.write(pickle.dumps((function, job, events_of_child)))
            self.process.stdin.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.end()

    def __iter__(self) -> Iterator[Row]:
        """Its events, and an empty one where none comes for a while.

        The last one has `ended`: it is the function's result, or has a `status` and a `message` that say why
        the function did not return.
        """
        while True:
            dead = self.process.poll() is not None
            for _ in range(FINAL_READS if dead else 1):
                self._listen(0 if dead else POLL_S)
            events, self.arrived = self.arrived, []
            if dead:
                events.append(self._exit())
            elif exceeded := self._exceeded():
                events.append(exceeded)
            for event in events or [{}]:
                yield event
                if event.get("ended"):
                    return

    def _listen(self, seconds: float) -> None:
        """Receive its events and what it prints, for at most `seconds`."""
        for key, _ in self.selector.select(seconds):
            chunk = os.read(key.fd, CHUNK)
            if chunk:
                key.data(chunk)
            else:
                self.selector.unregister(key.fileobj)
        if not self.selector.get_map():
            time.sleep(seconds)

    def _take_events(self, chunk: bytes) -> None:
        *lines, last = (self.pending + chunk).split(b"\n")
        self.pending = last[-LONGEST_EVENT:]  # what the solver writes to this descriptor may have no end
        for line in lines:
            try:
                event = json.loads(line)
            except ValueError:  # the solver wrote to this descriptor
                continue
            if isinstance(event, dict):
                if event.get("phase") in self.phases:
                    self.phase, self.phase_started = event.pop("phase"), time.monotonic()
                    self.limit_s = self.phases[self.phase] * event.pop("times", 1)
                self.arrived.append(event)

    def _take_stderr(self, chunk: bytes) -> None:
        self.stderr = (self.stderr + chunk)[-STDERR_TAIL:]
        self._take_printed(chunk)

    def _take_printed(self, chunk: bytes) -> None:
        room = LOG_END - len(self.log_start)
        self.log_start += chunk[:room]
        rest = self.log_rest + chunk[room:]
        self.log_cut += max(len(rest) - LOG_END, 0)
        self.log_rest = rest[-LOG_END:]

    @property
    def log(self) -> str:
        """What it printed on stdout and stderr, in the order in which it came, as far as that is kept."""
        cut = f"\n[{self.log_cut} bytes left out]\n".encode() if self.log_cut else b""
        return _text(self.log_start + cut + self.log_rest)

    @property
    def stderr_text(self) -> str | None:
        return _text(self.stderr).strip() or None

    def _exceeded(self) -> Row | None:
        """The end of a process that exceeds a limit."""
        now = time.monotonic()
        if now - self.checked_at < POLL_S:
            return None
        self.checked_at = now
        used, limit = self._memory_mib(), self.memory_limit_mib
        if self.phase != "save":  # then the solver is done
            self.peak_mib = max(self.peak_mib, used)
        if used > limit:
            return _end("memory_limit", f"{used:.0f} MiB, more than {limit} MiB")
        if now - self.phase_started > self.limit_s:
            status = "time_limit" if self.phase == "solve" else "failed"
            return _end(status, f"{self.phase} took more than {self.limit_s:g} s")
        return None

    def _memory_mib(self) -> float:
        """Resident memory of the process tree; pages that a fork shares are counted once."""
        if time.monotonic() - self.scanned_at > SCAN_S:
            self._find_descendants()
        total = 0
        alone = not self.descendants
        for process in (self.root, *self.descendants):
            with contextlib.suppress(psutil.NoSuchProcess, psutil.AccessDenied):
                total += process.memory_info().rss if alone else process.memory_full_info().pss
        return total / 2**20

    def _find_descendants(self) -> None:
        with contextlib.suppress(psutil.NoSuchProcess):
            self.descendants |= set(self.root.children(recursive=True))
        self.scanned_at = time.monotonic()

    def _exit(self) -> Row:
        code = self.process.returncode
        if code < 0:
            hint = ", perhaps by the system because memory ran out" if code == -signal.SIGKILL else ""
            return _end("crashed", f"killed by {signal.Signals(-code).name}{hint}")
        return _end("crashed", f"ended with exit code {code} before its answer")

    def end(self) -> None:
        """Kill the process and all its descendants, those that left its process group too."""
        if self.events.closed:
            return
        self._find_descendants()
        if self.process.poll() is None:
            os.kill(self.process.pid, signal.SIGSTOP)
            end_children(self.process.pid)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, signal.SIGKILL)
        for process in self.descendants:
            with contextlib.suppress(psutil.NoSuchProcess):
                process.kill()
        self.process.wait()
        self.selector.close()
        for stream in (self.events, self.process.stdin, self.process.stdout, self.process.stderr):
            if stream is not None:
                with contextlib.suppress(BrokenPipeError):  # it died before it read its job
                    stream.close()


def _text(printed: bytes) -> str:
    """What was printed; files of this project by their paths within it, which are the same everywhere."""
    return printed.decode(errors="replace").replace(f"{ROOT}{os.sep}", "")


def _end(status: str, message: str) -> Row:
    return {"status": status, "message": message, "ended": True}
