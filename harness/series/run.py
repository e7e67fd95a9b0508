"""Runs a series: solves the cases that DIRECTORY lacks, writes rows and gaps as they come in."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from harness.measurement.scheduler import done_as_completed, workers
from harness.results import records, series_file
from harness.results.provenance import installed_version, machine
from harness.results.schema import VERDICTS
from harness.terminal.exit_codes import DONE, FAILED, NOTHING_JUDGED
from harness.verification.reference import UNPROVEN
from problems.build import prepared
from problems.model.scene import JointScene

from . import store
from .isolated import solve_isolated
from .on_worker import solve_on_worker
from .session import BLOCK, Job, Result, SeriesSession


@dataclass
class Tally:
    """Counts of verdicts, the largest error bound and the largest error of the cases compared."""

    counts: dict[str, int]
    worst_bound_mm: float = 0.0
    worst_error_mm: float | None = None
    compared: int = 0

    def add(self, row: dict[str, Any]) -> None:
        self.counts[row["verdict"]] += 1
        bound = row.get("bound_mm", 0.0)  # missing without an answer; null in the file where it is infinite
        self.worst_bound_mm = max(self.worst_bound_mm, np.inf if bound is None else bound)
        error = row.get("displacement_error_mm")
        if error is not None:
            self.compared += 1
            self.worst_error_mm = max(self.worst_error_mm or 0.0, error)


def run(
    job: Job, facts: dict[str, Any], directory: Path, console: Console, scheduler: str | None = None
) -> int:
    """Solve the remaining cases of a series. `facts`: of the solver; part of its identity.

    Returns 0, 1 if an answer is outside the limit or missing, 3 if none could be judged. Raises InputError
    if DIRECTORY holds another series; after KeyboardInterrupt the same command resumes.
    """
    with records.locked(directory, (), other=records.MEASUREMENTS):
        store.open_series(directory, identity(job) | facts, metadata(job))
        done = store.solved(directory, job.cases)
        remaining = np.flatnonzero(~done).tolist()
        console.print(
            f"{job.scene.name}: {len(done)} cases, {len(done) - len(remaining)} already in {directory}"
        )
        if remaining:
            with results_of(job, remaining, scheduler, console) as results:
                solve_remaining(job, len(remaining), results, directory, console)
        tally = Tally(dict.fromkeys(VERDICTS, 0))
        for row in series_file.rows(directory):
            if row["case"] < job.cases.count:
                tally.add(row)
    return summary(tally, job.cases.count, console)


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
        with console.status("opening the assembly, preparing the solver"):
            session = SeriesSession(job)
        yield session.solve(remaining)
        return
    with workers(scheduler) as (executor, count):
        console.print(f"{count} workers at {scheduler}")
        yield on_workers(job, remaining, executor, count, console)


def on_workers(
    job: Job, remaining: list[int], executor: Executor, count: int, console: Console
) -> Iterator[list[Result]]:
    """Blocks of cases, small enough that the workers end together. What fails is left for another run."""
    size = min(max(len(remaining) // (4 * count), 1), BLOCK)
    blocks = [remaining[start : start + size] for start in range(0, len(remaining), size)]
    tasks = ((block, (replace(job, cases=job.cases.only(block)), block)) for block in blocks)
    for block, outcome in done_as_completed(executor, count, solve_on_worker, tasks):
        if isinstance(outcome, BaseException):
            why = f"{type(outcome).__name__}: {outcome}".splitlines()[0]
            console.print(f"cases {block[0]} … {block[-1]} not solved, run again: {why}", style="red")
        else:
            yield outcome


def solve_remaining(
    job: Job, count: int, results: Iterator[list[Result]], directory: Path, console: Console
) -> None:
    """Write the results; only this process does."""
    record_contacts(job, directory)
    begun, made = time.monotonic(), 0
    with display(console) as progress:
        task = progress.add_task(job.scene.name, total=count, rate="")
        for some in results:
            series_file.append(directory, some)
            made += len(some)
            rate = f"{made / (time.monotonic() - begun):.3g} cases/s"
            progress.update(task, completed=made, rate=rate)
            print_failures(some, console)
    console.print(f"{made} cases in {time.monotonic() - begun:.1f} s")


def display(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("left"),
        console=console,
        disable=not console.is_terminal,
    )


def print_failures(results: list[Result], console: Console) -> None:
    """Print a line for each case without an answer or outside the limit."""
    for result in results:
        row = result.row
        if row["verdict"] in ("outside", "no_answer"):
            why = row["message"] or f"{row.get('displacement_error_mm') or 0:.1e} mm off"
            console.print(f"case {row['case']}: {row['status']}, {row['verdict']}: {why}", style="red")


def identity(job: Job) -> dict[str, Any]:
    """What must be the same for rows to belong to one series."""
    return {
        "scene_key": job.scene.key,
        "cases_key": job.cases.key,
        "solver": job.solver,
        "options": job.options,
        "form": job.form,
        "tolerance": job.tolerance,
        "limit_mm": job.limit_mm,
        "rivetbench_version": installed_version("rivetbench"),
    }


def metadata(job: Job) -> dict[str, Any]:
    size = job.scene.expected_size
    return {
        "scene": job.scene.name,
        "title": job.scene.title,
        "cases": job.cases.count,
        "kind": type(job.cases).__name__,
        "n": size[0] if size else None,
        "threads": job.threads,
        "check": job.check,
        **machine(),
    }


def record_contacts(job: Job, directory: Path) -> None:
    """The positions of contacts and fasteners, for the figures."""
    assembly = prepared(job.scene, form=job.form).assembly
    arrays = {"m": np.array(assembly.m)}
    if assembly.contact_nodes is not None:
        arrays["contact_nodes"] = assembly.contact_nodes
    if isinstance(job.scene, JointScene):
        arrays["fasteners"] = job.scene.marks()
    series_file.write_contacts(directory, arrays)


def summary(tally: Tally, asked: int, console: Console) -> int:
    seen = [f"{count} {verdict.replace('_', ' ')}" for verdict, count in tally.counts.items() if count]
    error = f", largest of {tally.compared} checked {tally.worst_error_mm:.1e} mm" if tally.compared else ""
    worst = tally.worst_bound_mm
    bound = f"largest proven error bound {worst:.1e} mm" if np.isfinite(worst) else f"some bounds {UNPROVEN}"
    console.print(f"{', '.join(seen)}; {bound}{error}")
    missing = asked - sum(tally.counts.values())
    if missing:
        console.print(f"Not solved: {missing}. Run the same command again.", style="red")
        return FAILED
    if not tally.counts["within"] + tally.counts["outside"]:
        return NOTHING_JUDGED
    return FAILED if tally.counts["outside"] + tally.counts["no_answer"] else DONE
