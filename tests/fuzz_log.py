"""What the fuzzer of exact problems notes: faults by kind, hangs and tracebacks among them."""

import signal
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction

import numpy as np

from problems.forms.assembly import Vector

TIME_LIMIT_S = 20  # of the processor, per problem
WORST_SHOWN = 20


class Log:
    """Faults by kind, with the first of them in words; and how often what happened."""

    def __init__(self) -> None:
        self.faults: Counter[str] = Counter()
        self.words: list[str] = []
        self.seen: Counter[str] = Counter()
        self.where = ""

    def fault(self, kind: str, what: object) -> None:
        self.faults[kind] += 1
        said = f"{kind}: {self.where}: {what}"
        print(said, flush=True)
        if len(self.words) < WORST_SHOWN:
            self.words.append(said)

    def bound(self, what: str, x: Vector, bound_mm: float, exact: Vector) -> None:
        """A fault unless max|x − x*| ≤ bound, in rational numbers."""
        if bound_mm < np.inf and max_error(x, exact) > Fraction(bound_mm):
            self.fault("bound", f"{what}: {float(max_error(x, exact)):.3e} mm, bound {bound_mm:.3e} mm")


def max_error(x: Vector, exact: Vector) -> Fraction:
    """max|x − x*|, exactly."""
    return max(abs(Fraction(a) - Fraction(b)) for a, b in zip(x.tolist(), exact.tolist(), strict=True))


@contextmanager
def contained(log: Log) -> Iterator[None]:
    """A hang and a traceback are faults; the next problem goes on."""

    def stop(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, TIME_LIMIT_S)
    try:
        yield
    except TimeoutError:
        log.fault("hang", f"more than {TIME_LIMIT_S} s")
    except Exception as error:
        log.fault("traceback", repr(error))
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
