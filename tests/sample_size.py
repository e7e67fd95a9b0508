"""How much is tried: a sample, or with RIVETBENCH_LONG all of it; and what the fuzzers note of it."""

import os
import signal
import time
import traceback
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ASKED = int(os.environ.get("RIVETBENCH_LONG") or 0)
WORST_SHOWN = 25


def draws(short: int, long: int) -> int:
    """Of a fuzzer: `long` if RIVETBENCH_LONG is 1, its value if it is larger, `short` if it is not set."""
    return {0: short, 1: long}.get(ASKED, ASKED)


def tried(names: Iterable[str], solvers: Sequence[Any]) -> list[tuple[Any, ...]]:
    """(name, *solver): newton on every name, the others on every fifth; all with RIVETBENCH_LONG."""
    return [
        (name, *solver)
        for i, name in enumerate(names)
        for j, solver in enumerate(solvers)
        if ASKED or solver[0] == "newton" or (i + j) % 5 == 0
    ]


def seeds(short: int, long: int) -> range:
    """Of a parametrised test."""
    return range(long if ASKED else short)


class Fault(BaseException):
    """What a fuzzer exists to find; no `except Exception` of the code under test catches it.

    kind : hang, traceback, lost, wrong or words.
    """

    def __init__(self, kind: str, what: object) -> None:
        super().__init__(kind, what)
        self.kind, self.what = kind, what


class Log:
    """Faults by kind, with the first of them in words; and how often what was seen. where : this draw."""

    def __init__(self) -> None:
        self.faults: Counter[str] = Counter()
        self.words: list[str] = []
        self.seen: Counter[str] = Counter()
        self.where = ""
        self.tried, self.start = 0, time.monotonic()

    def fault(self, kind: str, what: object) -> None:
        self.faults[kind] += 1
        self.words.append(f"{kind}: {self.where}: {what}")
        print(self.words[-1], flush=True)

    def nothing_found(self) -> None:
        print(f"{self.tried} in {time.monotonic() - self.start:.0f} s:", dict(self.faults), dict(self.seen))
        assert not self.faults, "\n".join([str(dict(self.faults)), *self.words[:WORST_SHOWN]])

    @contextmanager
    def contained(self, where: str, seconds: float, clock: int = signal.ITIMER_REAL) -> Iterator[None]:
        """A hang of so many seconds and a traceback are faults; the next draw goes on."""
        self.where = where
        try:
            with _limited(seconds, clock):
                yield
        except Fault as fault:
            self.fault(fault.kind, fault.what)
        except Exception as error:
            frames = traceback.extract_tb(error.__traceback__)
            mine = [f for f in frames if "/site-packages/" not in f.filename]
            lines = [f"{Path(f.filename).name}:{f.lineno}" for f in mine[-3:]]
            self.fault("traceback", f"{error!r:.200} at {' '.join(lines)}")
        self.tried += 1
        if self.tried % 1000 == 0:
            print(f"{self.tried}, {time.monotonic() - self.start:.0f} s, {dict(self.faults)}", flush=True)


@contextmanager
def _limited(seconds: float, clock: int) -> Iterator[None]:
    def stop(*_: object) -> None:
        raise Fault("hang", f"more than {seconds} s")

    sent = signal.SIGPROF if clock == signal.ITIMER_PROF else signal.SIGALRM
    previous = signal.signal(sent, stop)
    signal.setitimer(clock, seconds)
    try:
        yield
    finally:
        signal.setitimer(clock, 0)
        signal.signal(sent, previous)
