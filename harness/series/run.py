"""Runs a series: the cases that DIRECTORY does not hold yet, rows and gaps as they come in."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from harness.measurement.scheduler import done_as_completed, workers
from harness.results import records
from harness.results.machine import installed_version, machine
from harness.terminal.exit_codes import DONE, FELL_SHORT, NOTHING_JUDGED
from harness.verification.reference import UNPROVEN
from problems.build import prepared
from problems.model.scene import JointScene

from . import store
from .on_worker import solve_on_worker
from .session import BLOCK, Job, Result, SeriesSession

VERDICTS = ("within", "outside", "cannot_be_judged", "no_answer")


@dataclass
class Tally:
    """What has been seen so far; of the errors the largest."""

    counts: dict[str, int]
    worst_bound_mm: float = 0.0
    worst_error_mm: float | None = None
    checked: int = 0

    def add(self, row: dict[str, Any]) -> None:
        self.counts[row["verdict"]] += 1
        bound = row.get("bound_mm", 0.0)  # missing without an answer; null in the file where it is infinite
        self.worst_bound_mm = max(self.worst_bound_mm, np.inf if bound is None else bound)
        error = row.get("displacement_error_mm")
        if error is not None:
            self.checked += 1
            self.worst_error_mm = max(self.worst_error_mm or 0.0, error)


def run(
    job: Job, facts: dict[str, Any], directory: Path, console: Console, scheduler: str | None = None
) -> int:
    """Solve what is left of a series. `facts` of the solver (version, code) are part of what it is.

    Returns 0, 1 where an answer was found outside the limit or is missing, 3 where none could be judged.
    Raises InputError where DIRECTORY holds another series; KeyboardInterrupt leaves one that resumes.
    """
    with records.held(directory, ()):
        store.claim(directory, identity(job) | facts, about(job))
        done = store.solved(directory, job.cases)
        left = np.flatnonzero(~done).tolist()
        console.print(f"{job.scene.name}: {len(done)} cases, {len(done) - len(left)} already in {directory}")
        if left:
            with at_work(job, left, scheduler, console) as results:
                solve_left(job, len(left), results, directory, console)
        tally = Tally(dict.fromkeys(VERDICTS, 0))
        for row in store.rows(directory):
            if row["case"] < job.cases.count:
                tally.add(row)
    return summary(tally, job.cases.count, console)


@contextmanager
def at_work(
    job: Job, left: list[int], scheduler: str | None, console: Console
) -> Iterator[Iterator[list[Result]]]:
    """The results as they come, of this process or of the workers of a scheduler."""
    if scheduler is None:
        with console.status("opening the assembly, preparing the solver"):
            desk = SeriesSession(job)
        yield desk.solve(left)
        return
    with workers(scheduler) as (executor, count):
        console.print(f"{count} workers at {scheduler}")
        yield on_workers(job, left, executor, count, console)


def on_workers(
    job: Job, left: list[int], executor: Executor, count: int, console: Console
) -> Iterator[list[Result]]:
    """Blocks of cases, small enough that the workers end together. What fails is left for another run."""
    size = min(max(len(left) // (4 * count), 1), BLOCK)
    blocks = [left[start : start + size] for start in range(0, len(left), size)]
    tasks = ((block, (replace(job, cases=job.cases.only(block)), block)) for block in blocks)
    for block, outcome in done_as_completed(executor, count, solve_on_worker, tasks):
        if isinstance(outcome, BaseException):
            why = f"{type(outcome).__name__}: {outcome}".splitlines()[0]
            console.print(f"cases {block[0]} … {block[-1]} not solved, run again: {why}", style="red")
        else:
            yield outcome


def solve_left(
    job: Job, count: int, results: Iterator[list[Result]], directory: Path, console: Console
) -> None:
    """Write what comes; this process alone does."""
    m = remember_contacts(job, directory)
    begun, made = time.monotonic(), 0
    with display(console) as progress:
        task = progress.add_task(job.scene.name, total=count, rate="")
        for some in results:
            store.append(directory, some, m)
            made += len(some)
            rate = f"{made / (time.monotonic() - begun):.3g} cases/s"
            progress.update(task, completed=made, rate=rate)
            complain(some, console)
    console.print(f"{made} cases in {time.monotonic() - begun:.1f} s")


def display(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("left"),
        console=console,
        disable=not console.is_terminal,
    )


def complain(results: list[Result], console: Console) -> None:
    """A line for each case without an answer or outside the limit."""
    for result in results:
        row = result.row
        if row["verdict"] in ("outside", "no_answer"):
            why = row["message"] or f"{row.get('displacement_error_mm') or 0:.1e} mm off"
            console.print(f"case {row['case']}: {row['status']}, {row['verdict']}: {why}", style="red")


def identity(job: Job) -> dict[str, Any]:
    """What must be the same for rows to stand in one table."""
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


def about(job: Job) -> dict[str, Any]:
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


def remember_contacts(job: Job, directory: Path) -> int:
    """DIRECTORY/contacts.npz: where the contacts and the fasteners are, for the pictures. Returns m."""
    assembly = prepared(job.scene).assembly
    arrays = {"m": np.array(assembly.m)}
    if assembly.contact_nodes is not None:
        arrays["contact_nodes"] = assembly.contact_nodes
    if isinstance(job.scene, JointScene):
        arrays["fasteners"] = job.scene.marks()
    np.savez(directory / "contacts.npz", **arrays)  # type: ignore[arg-type]
    return assembly.m


def summary(tally: Tally, asked: int, console: Console) -> int:
    seen = [f"{count} {verdict.replace('_', ' ')}" for verdict, count in tally.counts.items() if count]
    error = f", largest of {tally.checked} checked {tally.worst_error_mm:.1e} mm" if tally.checked else ""
    worst = tally.worst_bound_mm
    bound = f"largest proven error bound {worst:.1e} mm" if np.isfinite(worst) else f"some bounds {UNPROVEN}"
    console.print(f"{', '.join(seen)}; {bound}{error}")
    missing = asked - sum(tally.counts.values())
    if missing:
        console.print(f"Not solved: {missing}. Run the same command again.", style="red")
        return FELL_SHORT
    if not tally.counts["within"] + tally.counts["outside"]:
        return NOTHING_JUDGED
    return FELL_SHORT if tally.counts["outside"] + tally.counts["no_answer"] else DONE
