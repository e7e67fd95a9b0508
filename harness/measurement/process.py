"""The driver's side of one measurement: start a worker, watch its limits from outside, end it.

Whatever the worker does (hang, crash, eat memory, fork, print without end), the outcome is a dict
with a `status`, and no process of it is left.
"""

from __future__ import annotations

import contextlib
import json
import os
import selectors
import signal
import site
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import psutil

from harness.planning.plan import Measurement
from harness.results.records import Row

from .process_tree import end_children

ROOT = Path(__file__).parents[2]
POLL_S = 0.05
#: The seconds that each phase may take: imports and opening the data; the solver, as long as the
#: measurement says; saving the answer.
PHASES = {"start": 300.0, "solve": None, "save": 60.0}
STDERR_TAIL = 2000  # bytes
CHUNK = 2**16  # bytes
LAST_WORDS = 64  # chunks read of what a dead worker wrote
FAMILY_S = 0.5  # between two looks for processes that the worker forked

JOB = ("source", "solver", "options", "plugin", "form", "tolerance", "yardstick", "batched")
#: What a worker says once, for all the load cases of a series.
SHARED = ("load_s", "convert_s", "prepare_s", "data_mib")
THREAD_VARIABLES = (
    *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS"),
    *("VECLIB_MAXIMUM_THREADS", "NUMEXPR_NUM_THREADS", "RAYON_NUM_THREADS"),
)


def environment(threads: int) -> dict[str, str]:
    """What a worker starts with: the thread counts, and where these packages are."""
    paths = [os.environ["PYTHONPATH"]] if os.environ.get("PYTHONPATH") else []
    if str(ROOT) not in (*site.getsitepackages(), site.getusersitepackages()):
        paths.insert(0, str(ROOT))
    count = dict.fromkeys(THREAD_VARIABLES, str(threads))
    return {**os.environ, **count, "OMP_DYNAMIC": "FALSE", "PYTHONPATH": os.pathsep.join(paths)}


def measure(measurements: Sequence[Measurement], answers: Sequence[Path]) -> list[Row]:
    """Run measurements in one process: one, or some load cases of a series. Each answer is saved.

    Returns the worker's part of each row: status, message, times, peak memory, … Where a case ends the
    process, those that follow have its status.
    """
    with Worker(measurements, answers) as worker:
        while not worker.over():
            worker.listen(POLL_S)
        last = worker.outcome()
        ended = measurements[len(worker.finished)].key
        lost = {"status": last["status"], "message": f"not run: {ended} ended the process"}
        rows = [*worker.finished, last]
        return rows + [lost] * (len(measurements) - len(rows))


class Worker:
    """A running measurement, as a context: on leaving it, every process of it is dead."""

    def __init__(self, measurements: Sequence[Measurement], answers: Sequence[Path]) -> None:
        measurement = measurements[0]
        self.limits = measurement
        self.count = len(measurements)
        self.finished: list[Row] = []  # all but the last
        self.said: Row = {}
        self.verdict: Row = {}  # what the driver decided: a limit passed
        self.stderr = b""
        self.peak_mib = 0.0
        self.family: set[psutil.Process] = set()
        self.phase = "start"
        self.phase_started = self.looked = self.counted = time.monotonic()
        events, theirs = os.pipe()
        job = {
            "events": theirs,
            "answers": list(map(str, answers)),
            "cases": [each.case for each in measurements],
            "series": measurement.series.model_dump() if measurement.series else None,
            **{name: getattr(measurement, name) for name in JOB},
        }
        try:
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-m", "harness.measurement.worker"],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                env=environment(measurement.threads),
                pass_fds=(theirs,),
                start_new_session=True,
            )
        finally:
            os.close(theirs)
        self.root = psutil.Process(self.process.pid)
        self.events = open(events, "rb", buffering=0)  # noqa: SIM115
        assert self.process.stdin is not None
        assert self.process.stderr is not None
        self.pending = b""
        self.selector = selectors.DefaultSelector()
        for stream, take in ((self.events, self._take_events), (self.process.stderr, self._take_stderr)):
            os.set_blocking(stream.fileno(), False)
            self.selector.register(stream, selectors.EVENT_READ, take)
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.write(json.dumps(job).encode() + b"\n")
            self.process.stdin.flush()

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *exc: object) -> None:
        self.end()

    def listen(self, seconds: float) -> None:
        """Take in what the worker says, for at most `seconds`."""
        for key, _ in self.selector.select(seconds):
            chunk = os.read(key.fd, CHUNK)
            if chunk:
                key.data(chunk)
            else:
                self.selector.unregister(key.fileobj)
        if not self.selector.get_map():
            time.sleep(seconds)

    def _take_events(self, chunk: bytes) -> None:
        *lines, self.pending = (self.pending + chunk).split(b"\n")
        for line in lines:
            try:
                event = json.loads(line)
            except ValueError:  # not the worker's: its solver wrote to every file it found open
                continue
            if isinstance(event, dict):
                self._take_event(event)

    def _take_event(self, event: Row) -> None:
        if event.get("phase") in PHASES:
            self.phase, self.phase_started = event.pop("phase"), time.monotonic()
        self.said |= event
        if "status" in event and not event.get("ended") and len(self.finished) < self.count - 1:
            self.finished.append({"stderr": None, **self.said})
            self.said = {name: self.said[name] for name in SHARED if name in self.said}

    def _take_stderr(self, chunk: bytes) -> None:
        self.stderr = (self.stderr + chunk)[-STDERR_TAIL:]

    def over(self) -> bool:
        """Whether it has ended, or must be: by its own word, its own death, or a limit."""
        if "status" in self.said:
            return True
        now = time.monotonic()
        if now - self.looked < POLL_S:
            return False
        self.looked = now
        if self.process.poll() is not None:
            for _ in range(LAST_WORDS):
                self.listen(0)
            return True
        self._look_at_memory()
        self._look_at_the_clock(now - self.phase_started)
        return bool(self.verdict)

    def _look_at_memory(self) -> None:
        used, limit = self.memory_mib(), self.limits.memory_limit_mib
        if self.phase != "save":  # then the solver is done
            self.peak_mib = max(self.peak_mib, used)
        if used > limit:
            self.verdict = {"status": "memory_limit", "message": f"{used:.0f} MiB, more than {limit} MiB"}

    def _look_at_the_clock(self, seconds: float) -> None:
        limit = PHASES[self.phase] or self.limits.time_limit_s * (self.limits.batched or 1)
        if seconds > limit:
            status = "time_limit" if self.phase == "solve" else "failed"
            self.verdict = {"status": status, "message": f"{self.phase} took more than {limit:g} s"}

    def memory_mib(self) -> float:
        """Resident memory of the process tree; pages that a fork shares are counted once."""
        if time.monotonic() - self.counted > FAMILY_S:
            self._count_the_family()
        total = 0
        alone = not self.family
        for process in (self.root, *self.family):
            with contextlib.suppress(psutil.NoSuchProcess, psutil.AccessDenied):
                total += process.memory_info().rss if alone else process.memory_full_info().pss
        return total / 2**20

    def _count_the_family(self) -> None:
        with contextlib.suppress(psutil.NoSuchProcess):
            self.family |= set(self.root.children(recursive=True))
        self.counted = time.monotonic()

    def outcome(self) -> Row:
        """What is known: the worker's events, or else why there is no answer."""
        self.end()
        peak = max(self.said.get("peak_rss_mib") or 0.0, self.peak_mib) or None
        stderr = self.stderr.decode(errors="replace").strip() or None
        said = self.said if "status" in self.said else {**self.said, **(self.verdict or self._death())}
        return {**said, "peak_rss_mib": peak, "stderr": stderr}

    def _death(self) -> Row:
        code = self.process.returncode
        if code < 0:
            hint = ", perhaps by the system for want of memory" if code == -signal.SIGKILL else ""
            return {"status": "crashed", "message": f"killed by {signal.Signals(-code).name}{hint}"}
        return {"status": "crashed", "message": f"ended with exit code {code} before its answer"}

    def end(self) -> None:
        """Kill every process of the worker, those that left its process group too."""
        if self.events.closed:
            return
        self._count_the_family()
        if self.process.poll() is None:
            os.kill(self.process.pid, signal.SIGSTOP)
            end_children(self.process.pid)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, signal.SIGKILL)
        for process in self.family:
            with contextlib.suppress(psutil.NoSuchProcess):
                process.kill()
        self.process.wait()
        self.selector.close()
        for stream in (self.events, self.process.stdin, self.process.stderr):
            if stream is not None:
                with contextlib.suppress(BrokenPipeError):  # a job that the worker did not live to read
                    stream.close()
