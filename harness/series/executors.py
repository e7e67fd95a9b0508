"""Where the cases of a series are solved: in this process, in a process of a plug-in's own, on workers.

A plug-in is under limits as in a measurement. A case that ends its process or exceeds a limit is a row that
says so; those before it are kept, those after it are left for another run.
"""

from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import closing, contextmanager
from dataclasses import replace

import numpy as np
from rich.console import Console

from harness.measurement.child_process import Events
from harness.measurement.monitored_call import Monitored
from harness.measurement.scheduler import done_as_completed, workers
from harness.measurement.worker import START_S
from harness.results.provenance import provenance
from harness.results.records import Row
from harness.solving.call_lock import in_turn
from harness.solving.solver_version import refuse_other_version, version_of
from harness.terminal.console import ConsoleReporter
from harness.verification.reference import proof_of
from problems.build import prepared
from problems.errors import Fault, InputError
from solvers.registry import make_solver

from .session import BLOCK, Job, Result, SeriesSession
from .staged import StagedSession, session_of

_sessions: dict[str, SeriesSession | StagedSession] = {}


@contextmanager
def results_of(
    job: Job, remaining: list[int], scheduler: str | None, console: Console
) -> Iterator[Iterator[list[Result]]]:
    """The results as they come, from this process, a plug-in's own, or the workers of a scheduler."""
    if scheduler is None and job.plugin:
        with closing(solve_isolated(job, remaining)) as results:
            yield results
        return
    if scheduler is None:
        with ConsoleReporter(console).step("opening the assembly, preparing the solver"):
            session = session_of(job)
        yield session.solve(remaining)
        return
    with workers(scheduler, console) as (executor, count):
        yield on_workers(job, remaining, executor, count, console)


def on_workers(
    job: Job, remaining: list[int], executor: Executor, count: int, console: Console
) -> Iterator[list[Result]]:
    """Blocks of cases, small enough that the workers end together. What fails is left for another run.

    Raises InputError if a task does: another run would meet the same.
    """
    size = min(max(len(remaining) // (4 * count), 1), BLOCK)
    blocks = [remaining[start : start + size] for start in range(0, len(remaining), size)]
    tasks = ((block, (replace(job, cases=job.cases.only(block)), block)) for block in blocks)
    for block, outcome in done_as_completed(executor, count, solve_on_worker, tasks):
        if isinstance(outcome, InputError):
            raise outcome
        if isinstance(outcome, BaseException):
            why = f"{type(outcome).__name__}: {outcome}".splitlines()[0]
            console.print(f"cases {block[0]} … {block[-1]} not solved, run again: {why}", style="red")
        else:
            yield outcome


def solve_isolated(
    job: Job, numbers: Sequence[int], batched: bool = True
) -> Generator[list[Result], None, None]:
    """The results as they come; the last one says how the process ended, if that was before its time.

    batched : whether cases may be solved at once; those that end the process are then tried one by one.
    Raises InputError if the plug-in cannot be imported or made.
    """
    proof_of(prepared(job.scene, form=job.form))  # builds what is not cached: without a limit
    running = list(numbers[:1])  # the cases that the plug-in is solving; before the first one, that one
    phases = {"opening the assembly": START_S, "solve": job.time_limit_s, "judging": START_S}
    task = replace(job, cases=job.cases.only(numbers)), list(numbers), batched
    with Monitored(solve_here, task, job.threads or 1, phases, job.memory_limit_mib) as process:
        for event in process:
            running = event.get("cases", running)
            if "row" in event:
                running = [case for case in running if case != event["row"]["case"]]
                gap = event["gap"]
                yield [Result(event["row"], None if gap is None else np.array(gap, np.float32))]
    if faults := event.get("faults"):
        raise InputError([Fault(**fault) for fault in faults])
    if "status" in event and len(running) > 1:
        yield from solve_isolated(job, running, batched=False)
    elif "status" in event:
        yield [Result(ended(job, case, event), None) for case in running]


def solve_here(task: tuple[Job, Sequence[int], bool], events: Events) -> None:
    """Solve the cases of a task in the child process; each result is an event."""
    job, numbers, batched = task
    solver = make_solver(job.solver, job.solver_options, job.plugin)
    refuse_other_matrices(job)
    if job.plugin_version:  # after its import, which may add folders of code
        version = version_of(job.solver, solver, job.plugin)
        refuse_other_version(job.solver, job.plugin, version, job.plugin_version)
    session = SeriesSession(job, solver, events.report, batched)
    for some in session.solve(numbers):
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
        "time_limit_s": job.time_limit_s,
        "memory_limit_mib": job.memory_limit_mib,
        **provenance(),
    }


def refuse_other_matrices(job: Job) -> None:
    """Raise InputError if the files of matrices are others than those at the beginning."""
    if job.scene_key and job.scene.key != job.scene_key:
        allowed = "those that the series has read: they have changed since, or are others on this worker"
        raise InputError.one(job.scene.source_of("K"), "matrices", "others", allowed)


@in_turn
def solve_on_worker(task: tuple[Job, Sequence[int]]) -> list[Result]:
    """Cases of a job, in the session that this process keeps for it: each worker opens the assembly once."""
    job, numbers = task
    if job.plugin:
        return [result for some in solve_isolated(job, numbers) for result in some]
    if job.key not in _sessions:
        refuse_other_matrices(job)
        _sessions.clear()
        _sessions[job.key] = session_of(job)
    session = _sessions[job.key]
    session.job = job  # holds these cases
    return [result for block in session.solve(numbers) for result in block]
