"""The driver's side of one measurement: start a worker, watch its limits from outside, end it.

Whatever the worker does (hang, crash, exhaust memory, fork, print without end), the outcome is a dict
with a `status`, and none of its processes survives.
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
#: The limit on each phase, s: imports and opening the data; the solver, whose limit is the measurement's;
#: saving the answer.
PHASES = {"start": 300.0, "solve": None, "save": 60.0}
STDERR_TAIL = 2000  # bytes
CHUNK = 2**16  # bytes
FINAL_READS = 64  # chunks of what a dead worker had written
SCAN_S = 0.5  # between two searches for processes that the worker forked

JOB = ("source", "solver", "options", "plugin", "form", "tolerance", "yardstick", "batched")
#: What a worker reports once for all the load cases of a series.
SHARED = ("load_s", "convert_s", "prepare_s", "data_mib")
THREAD_VARIABLES = (
    *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS"),
    *("VECLIB_MAXIMUM_THREADS", "NUMEXPR_NUM_THREADS", "RAYON_NUM_THREADS"),
)


def environment(threads: int) -> dict[str, str]:
    """The environment variables of a worker: the thread counts, and where these packages are."""
    paths = [os.environ["PYTHONPATH"]] if os.environ.get("PYTHONPATH") else []
    if str(ROOT) not in (*site.getsitepackages(), site.getusersitepackages()):
        paths.insert(0, str(ROOT))
    count = dict.fromkeys(THREAD_VARIABLES, str(threads))
    return {**os.environ, **count, "OMP_DYNAMIC": "FALSE", "PYTHONPATH": os.pathsep.join(paths)}


def measure(measurements: Sequence[Measurement], answers: Sequence[Path]) -> list[Row]:
    """Run measurements in one process: one, or load cases of a series. Each answer is saved.

    Returns the worker's part of each row: status, message, times, peak memory, … If a case ends the process,
    those that follow have its status.
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
    """A running measurement, as a context: on leaving it, all its processes are dead."""

    def __init__(self, measurements: Sequence[Measurement], answers: Sequence[Path]) -> None:
        measurement = measurements[0]
        self.limits = measurement
        self.count = len(measurements)
        self.finished: list[Row] = []  # all but the last
        self.row: Row = {}  # of the case being solved, so far
        self.exceeded: Row = {}  # the status and message of a limit that was exceeded
        self.stderr = b""
        self.peak_mib = 0.0
        self.descendants: set[psutil.Process] = set()
        self.phase = "start"
        self.phase_started = self.checked_at = self.scanned_at = time.monotonic()
        events, events_of_worker = os.pipe()
        job = {
            "events": events_of_worker,
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
                pass_fds=(events_of_worker,),
                start_new_session=True,
            )
        finally:
            os.close(events_of_worker)
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
        """Receive what the worker reports, for at most `seconds`."""
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
            except ValueError:  # the solver wrote to this descriptor
                continue
            if isinstance(event, dict):
                self._take_event(event)

    def _take_event(self, event: Row) -> None:
        if event.get("phase") in PHASES:
            self.phase, self.phase_started = event.pop("phase"), time.monotonic()
        self.row |= event
        if "status" in event and not event.get("ended") and len(self.finished) < self.count - 1:
            self.finished.append({"stderr": None, **self.row})
            self.row = {name: self.row[name] for name in SHARED if name in self.row}

    def _take_stderr(self, chunk: bytes) -> None:
        self.stderr = (self.stderr + chunk)[-STDERR_TAIL:]

    def over(self) -> bool:
        """Whether it has reported its end, died, or exceeded a limit."""
        if "status" in self.row:
            return True
        now = time.monotonic()
        if now - self.checked_at < POLL_S:
            return False
        self.checked_at = now
        if self.process.poll() is not None:
            for _ in range(FINAL_READS):
                self.listen(0)
            return True
        self._check_memory()
        self._check_time(now - self.phase_started)
        return bool(self.exceeded)

    def _check_memory(self) -> None:
        used, limit = self.memory_mib(), self.limits.memory_limit_mib
        if self.phase != "save":  # then the solver is done
            self.peak_mib = max(self.peak_mib, used)
        if used > limit:
            self.exceeded = {"status": "memory_limit", "message": f"{used:.0f} MiB, more than {limit} MiB"}

    def _check_time(self, seconds: float) -> None:
        limit = PHASES[self.phase] or self.limits.time_limit_s * (self.limits.batched or 1)
        if seconds > limit:
            status = "time_limit" if self.phase == "solve" else "failed"
            self.exceeded = {"status": status, "message": f"{self.phase} took more than {limit:g} s"}

    def memory_mib(self) -> float:
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

    def outcome(self) -> Row:
        """What is known: the worker's events, or else why there is no answer."""
        self.end()
        peak = max(self.row.get("peak_rss_mib") or 0.0, self.peak_mib) or None
        stderr = self.stderr.decode(errors="replace").strip() or None
        end = {} if "status" in self.row else self.exceeded or self._exit()
        return {**self.row, **end, "peak_rss_mib": peak, "stderr": stderr}

    def _exit(self) -> Row:
        code = self.process.returncode
        if code < 0:
            hint = ", perhaps by the system because memory ran out" if code == -signal.SIGKILL else ""
            return {"status": "crashed", "message": f"killed by {signal.Signals(-code).name}{hint}"}
        return {"status": "crashed", "message": f"ended with exit code {code} before its answer"}

    def end(self) -> None:
        """Kill every process of the worker, those that left its process group too."""
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
        for stream in (self.events, self.process.stdin, self.process.stderr):
            if stream is not None:
                with contextlib.suppress(BrokenPipeError):  # the worker died before it read its job
                    stream.close()
