"""Runs a suite: scene by scene, one worker process a measurement, one row each, resumable at any point."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from harness.planning.estimate import refuse_limits_too_low
from harness.planning.plan import Measurement, expand
from harness.planning.suite import Suite, to_toml
from harness.planning.timeouts import predicted_timeout
from harness.results import records
from harness.results.machine import machine
from harness.results.provenance import provenance
from harness.results.records import Row
from harness.terminal.exit_codes import DONE, FELL_SHORT, NOTHING_JUDGED
from harness.terminal.progress import Display
from harness.verification.ground_truth import Ground, ground, record, record_refusal
from problems.scene import read_scene

from .describe import Description, Solvers, describe
from .resume import resumed
from .row import Measured, Order, measured, measured_on_worker, rows_of
from .scheduler import done_as_completed, workers


def run(suite: Suite, directory: Path, console: Console, scheduler: str | None = None) -> int:
    """Make the suite's measurements that DIRECTORY does not hold yet, here or on a scheduler's workers.

    Returns 0, 1 when a worker was lost too often, or 3 when no row of the suite could be judged. Raises
    InputError before the first measurement where the suite cannot be run; KeyboardInterrupt leaves a
    directory that resumes.
    """
    descriptions = describe(suite)
    suite = with_forms(suite, descriptions)
    solvers = {(e.name, e.variant): d for e, d in zip(suite.solver, descriptions, strict=True)}
    plan = expand(suite)
    refuse_limits_too_low(plan)
    with records.held(directory):
        rows = resumed(directory, plan, solvers, console)
        records.replace_text(directory / "suite.toml", to_toml(suite))
        for scene in map(read_scene, suite.scenes):
            if scene.refused:
                record_refusal(scene, directory)
        here = {"machine": remember_machine(directory, machine()), **provenance()}
        made = {row["key"] for row in rows}
        left = [m for m in plan if m.key not in made]
        done = len(plan) - len(left)
        console.print(f"{suite.name}: {len(plan)} measurements, {done} of them already in {directory}")
        if left:
            with outcomes_of(scheduler, directory, console) as outcomes:
                rows = measure_all(left, rows, done, directory, solvers, here, outcomes, console)
    planned = {m.key for m in plan}
    code = summary([row for row in rows if row["key"] in planned], console)
    missing = len(planned - {row["key"] for row in rows})
    if missing:
        console.print(f"Not measured: {missing}. Run the same command again.", style="red")
    return FELL_SHORT if missing else code


def with_forms(suite: Suite, descriptions: list[Description]) -> Suite:
    """The suite with the usual form for each entry that names none."""
    entries = zip(suite.solver, descriptions, strict=True)
    filled = [e.model_copy(update={"forms": e.forms or [found.usual_form]}) for e, found in entries]
    return suite.model_copy(update={"solver": filled})


@dataclass(frozen=True)
class Due:
    """A batch that is next, and what its answers are judged on."""

    batch: list[Measurement]
    base: Ground
    solver: Description


#: Takes what is due and what of it a process must know; gives back what is due with what was measured.
Outcomes = Callable[[Iterator[tuple[Due, Order]]], Iterator[tuple[Due, Measured | BaseException]]]


@contextmanager
def outcomes_of(scheduler: str | None, directory: Path, console: Console) -> Iterator[Outcomes]:
    """One measurement after another here, or one at a time on each worker of a scheduler."""
    if scheduler is None:
        yield lambda tasks: ((due, measured(order, directory / "answers")) for due, order in tasks)
        return
    with workers(scheduler) as (executor, count):
        console.print(f"{count} workers at {scheduler}")
        yield partial(done_as_completed, executor, count, measured_on_worker)


def measure_all(
    left: list[Measurement],
    rows: list[Row],
    done: int,
    directory: Path,
    solvers: Solvers,
    here: Row,
    outcomes: Outcomes,
    console: Console,
) -> list[Row]:
    """Make the measurements and append their rows. `rows` are those of DIRECTORY so far."""
    sizes = {m.scene: size[0] for m in left if (size := read_scene(m.source).expected_size)}
    rows = list(rows)
    with Display(console, left, done, sizes) as display:
        for due, outcome in outcomes(due_next(left, rows, directory, solvers, display)):
            if isinstance(outcome, BaseException):
                why = f"{type(outcome).__name__}: {outcome}".splitlines()[0]
                console.print(f"{due.batch[0].key}: not measured: {why}", style="red")
                continue
            where = here
            if outcome.machine and outcome.code:
                where = {"machine": remember_machine(directory, outcome.machine), **outcome.code}
            made = rows_of(due.batch, outcome, due.base, directory, due.solver, where)
            records.append(directory / records.MEASUREMENTS, *made)
            rows += made
            for each, row in zip(due.batch, made, strict=True):
                display.finished(each, row, outcome.elapsed_s / len(due.batch))
    return rows


def due_next(
    left: list[Measurement], rows: list[Row], directory: Path, solvers: Solvers, display: Display
) -> Iterator[tuple[Due, Order]]:
    """One batch after another, each scene opened when its first is due. `rows` grow meanwhile."""
    base = None
    for batch in batches(left):
        m = batch[0]
        if base is None or base.scene.name != m.scene:
            start = time.monotonic()
            base = ground(m.source, partial(display.building, m.scene))
            record(base, directory)
            display.ready(m.scene, time.monotonic() - start)
        display.doing(f"{m.scene}: {m.solver} {m.form}")
        solver = solvers[m.solver, m.variant]
        hopeless = predicted_timeout(m, base.prepared.assembly.n, rows)
        yield Due(batch, base, solver), Order(batch, solver.forms, hopeless)


def batches(left: list[Measurement]) -> list[list[Measurement]]:
    """The measurements that one process makes: one each, or the load cases of a series."""
    found: dict[object, list[Measurement]] = {}
    for m in left:
        found.setdefault(m.key if m.case is None else m.process, []).append(m)
    return list(found.values())


def remember_machine(directory: Path, here: dict[str, Any]) -> str:
    """Write DIRECTORY/machine.json, keep that of another machine under another name; returns its line."""
    new = directory / "machine.json"
    for path in sorted(directory.glob("machine*.json")):
        with suppress(OSError, ValueError):
            if json.loads(path.read_text("utf-8"))["machine"] == here["machine"]:
                new = path
                break
            if path == new:
                path.rename(path.with_name(f"machine-{len(list(directory.glob('machine*.json')))}.json"))
    records.replace_text(new, json.dumps(here, indent=1, ensure_ascii=False) + "\n")
    return str(here["machine"])


def summary(rows: list[Row], console: Console) -> int:
    """Say how many rows there are of each verdict; 3 if none could be judged."""
    counts = Counter(row["verdict"] for row in rows)
    console.print(", ".join(f"{count} {verdict.replace('_', ' ')}" for verdict, count in counts.items()))
    if counts["within"] + counts["outside"]:
        return DONE
    console.print("Nothing could be judged: no row has an answer.", style="red")
    return NOTHING_JUDGED
