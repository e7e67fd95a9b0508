"""Runs a suite: scene by scene, one worker process and one row per measurement, resumable at any point."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from math import inf
from pathlib import Path
from typing import Any

from rich.console import Console

from harness.planning.plan import Measurement, expand, of_key, with_key
from harness.planning.suite import Suite, to_toml
from harness.planning.tolerance_search import exceeded_on, still_needed, time_limit
from harness.results import records
from harness.results.provenance import machine, provenance
from harness.results.records import Row
from harness.results.schema import Origin
from harness.terminal import DONE, FAILED, NOTHING_JUDGED
from harness.terminal.console import ConsoleReporter, Display
from harness.verification.reference_problem import (
    ReferenceProblem,
    measurable,
    record,
    record_refusal,
)
from problems.forms import form_family
from problems.forms.problem import in_form
from problems.scene_files import read_scene

from .scheduler import done_as_completed, workers
from .solver_descriptions import Description, Solvers, describe, resumed
from .task import Task, TaskResult, rows_of, run_task, run_task_on_worker


def run(
    suite: Suite, directory: Path, console: Console, scheduler: str | None = None, key: str | None = None
) -> int:
    """Make the suite's measurements that DIRECTORY does not hold yet, here or on a scheduler's workers; with
    a key, only what the row of that key needs.

    Returns 0, 1 when a worker was lost too often, or 3 when no row of the suite could be judged. Raises
    InputError before the first measurement if the suite cannot be run; after KeyboardInterrupt the same
    command resumes.
    """
    if key is not None:
        suite = with_key(suite, key)
    descriptions = describe(suite, ConsoleReporter(console))
    suite = with_forms(suite, descriptions)
    solvers = {(e.name, e.label): d for e, d in zip(suite.solver, descriptions, strict=True)}
    plan = expand(suite) if key is None else of_key(expand(suite), key)
    with records.locked(directory):
        rows = resumed(directory, plan, solvers, console)
        records.replace_text(directory / "suite.toml", to_toml(suite))
        for scene in map(read_scene, suite.scenes):
            if scene.refused:
                record_refusal(scene, directory)
        origin: Origin = {"machine": record_machine(directory, machine()), **provenance()}
        remaining = unmeasured(plan, rows)
        done = len(plan) - len(remaining)
        console.print(f"{suite.name}: {len(plan)} measurements, {done} of them already in {directory}")
        if remaining:
            with outcomes_of(scheduler, directory, console) as outcomes:
                rows = measure_remaining(remaining, rows, done, directory, solvers, origin, outcomes, console)
    planned = {m.key for m in plan}
    code = summary([row for row in rows if row["key"] in planned], console)
    missing = len(unmeasured(plan, rows))
    if missing:
        console.print(f"Not measured: {missing}. Run the same command again.", style="red")
    return FAILED if missing else code


def unmeasured(plan: list[Measurement], rows: list[Row]) -> list[Measurement]:
    """Those without a row that need one."""
    done = {row["key"] for row in rows}
    return [m for m in plan if m.key not in done and still_needed(m, rows) is not None]


def with_forms(suite: Suite, descriptions: list[Description]) -> Suite:
    """The suite with the usual form for each entry that names none."""
    entries = zip(suite.solver, descriptions, strict=True)
    filled = [e.model_copy(update={"forms": e.forms or [found.default_form]}) for e, found in entries]
    return suite.model_copy(update={"solver": filled})


#: A task that is being done, and the problem that its answers are judged on.
Pending = tuple[Task, ReferenceProblem]
#: Does tasks, each beside what stays here; gives back the latter with the result, or what was raised.
Outcomes = Callable[[Iterator[tuple[Pending, Task]]], Iterator[tuple[Pending, TaskResult | BaseException]]]


@contextmanager
def outcomes_of(scheduler: str | None, directory: Path, console: Console) -> Iterator[Outcomes]:
    """One measurement after another here, or one at a time on each worker of a scheduler."""
    if scheduler is None:
        yield lambda tasks: ((pending, run_task(task, directory / "answers")) for pending, task in tasks)
        return
    with workers(scheduler, console) as (executor, count):
        yield partial(done_as_completed, executor, count, run_task_on_worker)


def measure_remaining(
    remaining: list[Measurement],
    rows: list[Row],
    done: int,
    directory: Path,
    solvers: Solvers,
    origin: Origin,
    outcomes: Outcomes,
    console: Console,
) -> list[Row]:
    """Make the measurements and append their rows. `rows` are those of DIRECTORY so far."""
    rows, recorded = list(rows), set[tuple[str, str]]()
    with Display(console, len(remaining), done) as display:
        for (task, problem), outcome in outcomes(pending_tasks(remaining, rows, directory, solvers, display)):
            batch = task.batch
            if isinstance(outcome, BaseException):
                why = f"{type(outcome).__name__}: {outcome}".splitlines()[0]
                console.print(f"{batch[0].key}: not measured: {why}", style="red")
                continue
            of_worker = origin
            if outcome.machine and outcome.code:
                of_worker = {"machine": record_machine(directory, outcome.machine), **outcome.code}
            new = rows_of(task, outcome, problem, directory, of_worker)
            name = problem.scene.name, form_family(problem.form)
            if name not in recorded:
                record(problem, directory)
                recorded.add(name)
            records.append(directory / records.MEASUREMENTS, *new)
            rows += new
            for row in new:
                display.finished(row)
    return rows


def pending_tasks(
    remaining: list[Measurement], rows: list[Row], directory: Path, solvers: Solvers, display: Display
) -> Iterator[tuple[Pending, Task]]:
    """One task after another; a scene is opened before its first of a family. `rows` grow meanwhile."""
    opened: dict[str, ReferenceProblem] = {}  # of the current scene: condensed, or sparse
    made = set[str]()  # the forms whose matrices are
    for batch in batches(remaining):
        m = still_needed(batch[0], rows)
        if m is None:
            display.passed_over(len(batch))
            continue
        if any(problem.scene.name != m.scene for problem in opened.values()):
            opened, made = {}, set()
        family = form_family(m.form)
        if family not in opened:
            with display.step(m.scene):
                opened[family] = measurable(m.source, display, m.suite.reference_limit_s, m.form)
        problem = opened[family]
        if m.form not in made:
            _ = in_form(problem.prepared, m.form).arrays  # before the clock starts
            made.add(m.form)
        display.progress(f"{m.scene}: {m.solver} {m.form}")
        limit_s, stop = time_limit(m, rows)
        batch = [replace(each, time_limit_s=limit_s, stop=stop) for each in (m, *batch[1:])]
        exceeded = exceeded_on(batch[0], problem.prepared.assembly.junction_size, rows)
        task = Task(batch, solvers[m.solver, m.variant], exceeded)
        yield (task, problem), task


def batches(remaining: list[Measurement]) -> list[list[Measurement]]:
    """The measurements that one process makes: one each, or the load cases of a series."""
    found: dict[object, list[Measurement]] = {}
    for m in remaining:
        found.setdefault(m.key if m.case is None else m.process, []).append(m)
    return list(found.values())


def record_machine(directory: Path, found: dict[str, Any]) -> str:
    """Write DIRECTORY/machine.json, keep that of another machine under another name; returns its name."""
    new = directory / "machine.json"
    for path in sorted(directory.glob("machine*.json")):
        with suppress(OSError, ValueError):
            if records.parsed(path.read_bytes()).get("machine") == found["machine"]:
                new = path
                break
            if path == new:
                path.rename(path.with_name(f"machine-{len(list(directory.glob('machine*.json')))}.json"))
    records.replace_object(new, found)
    return str(found["machine"])


def summary(rows: list[Row], console: Console) -> int:
    """Say how many rows there are of each verdict; 3 if none could be judged."""
    counts = Counter(row["verdict"] for row in rows)
    console.print(", ".join(f"{count} {verdict.replace('_', ' ')}" for verdict, count in counts.items()))
    if counts["within"] + counts["outside"]:
        return DONE
    why = "no row has an answer"
    if unjudged := [row for row in rows if row["verdict"] == "cannot_be_judged"]:
        bounds = (row["reference_bound_mm"] for row in unjudged)  # null is an infinite one
        least = min(inf if bound is None else bound for bound in bounds)
        known = f"the references are proven to {least:.0e} mm" if least < inf else "no reference is proven"
        why = f"{known}, and a tenth of the limit is needed"
    console.print(f"Nothing could be judged: {why}.", style="red")
    return NOTHING_JUDGED
