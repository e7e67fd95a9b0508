"""Cases of a series that a plug-in solves in a process of its own, under limits as in a measurement.

A case that ends the process or exceeds a limit is a row that says so; those before it are kept, those after
it are left for another run.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from harness.measurement.child import Events
from harness.measurement.monitored import Monitored
from harness.measurement.stored_files import StoredFiles
from harness.measurement.worker import START_S
from harness.results.provenance import provenance
from harness.results.records import Row
from harness.verification.assess import Assessment
from harness.verification.reference import proof_of
from problems.build import prepared
from problems.errors import Fault, InputError
from problems.forms.assembly import LoadCase

from .session import Attempt, Job, Result, SeriesSession


def solve_isolated(job: Job, numbers: Sequence[int]) -> Generator[list[Result], None, None]:
    """The results as they come; the last ones say how the process ended, if that was before its time.

    Raises InputError if the plug-in cannot be imported or made.
    """
    proof_of(prepared(job.scene, form=job.form))  # builds what is not cached: without a limit
    running = list(numbers[:1])  # the cases that the plug-in is solving; before the first one, that one
    phases = {"opening the assembly": START_S, "solve": job.time_limit_s, "judging": START_S}
    task = replace(job, cases=job.cases.only(numbers)), list(numbers)
    with Monitored(solve_here, task, job.threads or 1, phases, job.memory_limit_mib) as process:
        for event in process:
            running = event.get("cases", running)
            if "row" in event:
                gap = event["gap"]
                yield [Result(event["row"], None if gap is None else np.array(gap, np.float32))]
    if faults := event.get("faults"):
        raise InputError([Fault(**fault) for fault in faults])
    if "status" in event:
        yield [Result(ended(job, case, event), None) for case in running]


def solve_here(task: tuple[Job, Sequence[int]], events: Events) -> None:
    """The same, in the process of its own."""
    job, numbers = task
    for some in ReportingSession(job, events).solve(numbers):
        for result in some:
            events.report(row=result.row, gap=result.gap)


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
        self.report(phase="solve", times=len(loads), cases=[case for case, _ in loads])
        return super()._try_batch(loads)

    def _assessed(self, attempts: list[Attempt]) -> dict[int, Assessment]:
        self.report(phase="judging")
        self.stored.check()
        return super()._assessed(attempts)
