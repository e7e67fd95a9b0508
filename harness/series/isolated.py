"""Cases of a series that a plug-in solves in a process of its own, under limits as in a measurement.

A case that ends the process or exceeds a limit is a row that says so; those before it are kept, those after
it are left for another run.
"""

from __future__ import annotations

import pickle
from base64 import b64decode, b64encode
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace

import numpy as np

from harness.measurement.child import Events, await_end, receive
from harness.measurement.limited import POLL_S, Limited
from harness.measurement.process import START_S
from harness.measurement.stored_files import StoredFiles
from harness.results.provenance import provenance
from harness.results.records import Row
from harness.solving.answers import error_text
from harness.verification.assess import Assessment
from harness.verification.reference import proof_of
from problems.build import prepared
from problems.errors import Fault, InputError
from problems.forms.assembly import LoadCase

from .session import Attempt, Job, Result, SeriesSession


class Isolated(Limited):
    """A running process. running : the cases that the plug-in is solving; before the first one, that one."""

    def __init__(self, job: Job, numbers: Sequence[int]) -> None:
        self.results: list[Result] = []
        self.running = list(numbers[:1])
        self.time_limit_s = job.time_limit_s
        self.limits = {"opening the assembly": START_S, "solve": job.time_limit_s, "judging": START_S}
        packed = pickle.dumps(replace(job, cases=job.cases.only(numbers)))
        task = {"job": b64encode(packed).decode(), "numbers": list(numbers)}
        module = "harness.series.isolated"
        super().__init__(module, task, job.threads or 1, self.limits, job.memory_limit_mib)

    def take(self, event: Row) -> None:
        if result := event.pop("result", None):
            gap = result["gap"]
            self.results.append(Result(result["row"], None if gap is None else unpacked(gap)))
        self.running = event.pop("cases", self.running)
        self.limits["solve"] = self.time_limit_s * len(self.running)
        super().take(event)

    def taken(self) -> Iterator[list[Result]]:
        """The results since the last call."""
        some, self.results = self.results, []
        if some:
            yield some


def unpacked(gap: str) -> np.ndarray:
    return np.frombuffer(b64decode(gap), np.float32)


def solve_isolated(job: Job, numbers: Sequence[int]) -> Generator[list[Result], None, None]:
    """The results as they come; the last ones say how the process ended, if that was before its time.

    Raises InputError if the plug-in cannot be imported or made.
    """
    proof_of(prepared(job.scene, form=job.form))  # builds what is not cached: without a limit
    with Isolated(job, numbers) as child:
        while not child.over():
            child.listen(POLL_S)
            yield from child.taken()
        end = child.outcome()
        yield from child.taken()
    if end["status"] == "refused":
        raise InputError([Fault(**fault) for fault in end["faults"]])
    if end["status"] != "done":
        yield [Result(ended(job, case, end), None) for case in child.running]


def ended(job: Job, case: int, end: Row) -> Row:
    """The row of a case that the process did not survive."""
    return {
        "case": case,
        **job.cases.parameters(case),
        "status": end["status"],
        "message": end["message"],
        "verdict": "no_answer",
        "limit_mm": job.limit_mm,
        **provenance(),
    }


class ReportingSession(SeriesSession):
    """A session that says when the plug-in begins and ends, so that each case has its time limit.

    A case is judged as soon as it is solved, unless the plug-in solves several at once.
    """

    block_time_s = 0.0

    def __init__(self, job: Job, events: Events) -> None:
        self.report = events.report
        super().__init__(job)
        self.stored = StoredFiles(self.problem.arrays)

    @contextmanager
    def _lap(self, name: str) -> Iterator[None]:
        if name == "convert_s":
            self.report(phase="solve")
        with super()._lap(name):
            yield

    def _try(self, case: int, load: LoadCase) -> Attempt:
        self.report(phase="solve", cases=[case])
        return super()._try(case, load)

    def _try_batch(self, loads: list[tuple[int, LoadCase]]) -> list[Attempt]:
        self.report(phase="solve", cases=[case for case, _ in loads])
        return super()._try_batch(loads)

    def _assessed(self, attempts: list[Attempt]) -> dict[int, Assessment]:
        self.report(phase="judging")
        self.stored.check()
        return super()._assessed(attempts)


def main() -> None:
    task, events = receive()
    try:
        job = pickle.loads(b64decode(task["job"]))
        for some in ReportingSession(job, events).solve(task["numbers"]):
            for result in some:
                gap = None if result.gap is None else b64encode(result.gap.tobytes()).decode()
                events.report(result={"row": result.row, "gap": gap})
        events.report(status="done")
    except InputError as error:
        events.report(status="refused", faults=[asdict(fault) for fault in error.faults])
    except MemoryError as error:
        events.report(status="memory_limit", message=f"the solver ran out of memory: {error}")
    except BaseException as error:
        events.report(status="failed", message=f"raised {error_text(error)}")
    await_end()


if __name__ == "__main__":
    main()
