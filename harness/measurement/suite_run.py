"""Runs a suite: scene by scene, one worker process and one row per measurement, resumable at any point."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from functools import partial
from itertools import count
from math import inf
from pathlib import Path
from typing import Any

from rich.console import Console

from harness.planning.plan import Measurement, expand, of_key, round_beside, with_key
from harness.planning.suite import Suite
from harness.planning.tolerance_search import (
    Cell,
    by_solver,
    cell_of,
    decided_by,
    decides_on,
    still_needed,
    unmeasured,
)
from harness.results import records
from harness.results.provenance import machine, provenance
from harness.results.records import Row
from harness.results.schema import ROUND, Origin
from harness.terminal import DONE, FAILED, NOTHING_JUDGED
from harness.terminal.console import ConsoleReporter, Display
from harness.verification.reference_problem import ReferenceProblem, measurable, record, record_refusal
from problems.forms import default_form, form_family
from problems.forms.problem import in_form
from problems.scene_files import read_scene
from report.document.numbers import counted, upwards

from .recorded_suite import other_suite, record_suite
from .scheduler import done_as_completed, workers
from .solver_descriptions import Solvers, describe, rows_in, set_aside, valid_and_old
from .task import Task, TaskResult, rows_of, run_task, run_task_on_worker


def run(
    suite: Suite, directory: Path, console: Console, scheduler: str | None = None, key: str | None = None
) -> int:
    """Make the suite's measurements that DIRECTORY does not hold yet, here or on a scheduler's workers.

    With a key, only what the row of that key needs is measured. Returns 0, 1 when a worker was lost too
    often, or 3 when no row of the suite could be judged. Raises InputError before the first measurement if
    the suite cannot be run; after KeyboardInterrupt the same command resumes.
    """
    if key is not None:
        key = key.partition(ROUND)[0]
        suite = with_key(suite, key)
    pairs = list(zip(suite.solver, describe(suite, ConsoleReporter(console)), strict=True))
    solvers = {(e.name, e.label): d for e, d in pairs}
    filled = [e.model_copy(update={"forms": e.forms or [default_form(d.forms)]}) for e, d in pairs]
    suite = suite.model_copy(update={"solver": filled})
    plan = expand(suite)
    if key is not None:
        plan = of_key(plan, key)
        suite = suite.model_copy(update={"scenes": [plan[0].source], "solver": [plan[0].entry]})
    folders, outputs = ("answers", "scenes", "logs"), ("report", *other_suite(directory, suite))
    with records.locked(directory, folders=folders, outputs=outputs):
        rows = rows_in(directory, console)
        valid, old = valid_and_old(rows, plan, solvers)
        record_suite(directory, suite, plan, rows if key else valid, key)
        set_aside(directory, valid, old, console)
        rows = valid
        for scene in map(read_scene, suite.scenes):
            if scene.refused:
                record_refusal(scene, directory)
        origin: Origin = {"machine": record_machine(directory, machine()), **provenance()}
        remaining = unmeasured(plan, rows)
        done = len(plan) - len(remaining)
        where = f", {done} of them already in {directory}" if done else ""
        console.print(f"{suite.name}: {counted(len(plan), 'measurement')}{where}")
        if remaining:
            display = Display(console, len(remaining), done)
            measuring = Measuring(directory, rows, solvers, origin, display)
            with outcomes_of(scheduler, directory, console) as outcomes, display:
                measuring.measure(remaining, outcomes)
    planned = {m.key for m in plan}
    code = summary([row for row in rows if row["key"] in planned], console)
    if missing := unmeasured(plan, rows):
        of = counted(len(missing), "measurement")
        console.print(f"{of} could not be made; the same command tries again.", style="red")
    return FAILED if missing else code


#: For so long after the beginning of a round, what is measured on its scene is measured beside it.
ROUND_LASTS = timedelta(hours=1)
#: A task that is being done, and the problem that its answers are judged on.
Pending = tuple[Task, ReferenceProblem]
#: Does tasks, each beside what stays here; gives back the latter with the result, or with the exception.
#: None stands for a task that cannot be chosen before one that is being done has ended.
Outcomes = Callable[
    [Iterator[tuple[Pending, Task] | None]], Iterator[tuple[Pending, TaskResult | BaseException]]
]


@contextmanager
def outcomes_of(scheduler: str | None, directory: Path, console: Console) -> Iterator[Outcomes]:
    """One measurement after another here, or one at a time on each worker of a scheduler."""
    if scheduler is None:
        answers = (directory / "answers").absolute()  # a solver may go to another folder
        yield lambda tasks: ((pending, run_task(task, answers)) for pending, task in filter(None, tasks))
        return
    with workers(scheduler, console) as (executor, count):
        yield partial(done_as_completed, executor, count, run_task_on_worker)


@dataclass
class Measuring:
    """Makes measurements and appends their rows to `rows` and to the files of the directory.

    of_solver : the rows of each solver. running : what is being measured. lost : searches that cannot go on.
    """

    directory: Path
    rows: list[Row]
    solvers: Solvers
    origin: Origin
    display: Display
    of_solver: defaultdict[str, list[Row]] = field(init=False)
    running: dict[str, Measurement] = field(default_factory=dict)
    lost: set[Cell] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.of_solver = by_solver(self.rows)

    def measure(self, remaining: list[Measurement], outcomes: Outcomes) -> None:
        """Make the measurements of a plan that are still needed when their turn comes."""
        recorded = set[tuple[str, str]]()
        for (task, problem), outcome in outcomes(self.tasks(remaining)):
            first = task.batch[0]
            self.running.pop(first.key, None)
            if isinstance(outcome, BaseException):
                self.lost |= {cell_of(first)} if first.searched else set()
                why = f"{type(outcome).__name__}: {outcome}".splitlines()[0]
                self.display.console.print(f"{first.key}: not measured: {why}", style="red")
                continue
            origin = self.origin
            if outcome.machine and outcome.code:
                origin = {"machine": record_machine(self.directory, outcome.machine), **outcome.code}
            rows = rows_of(task, outcome, problem, self.directory, origin)
            name = problem.scene.name, form_family(problem.form)
            if name not in recorded:
                record(problem, self.directory, self.origin["machine"])  # opened and proven here
                recorded.add(name)
            records.append(self.directory / records.MEASUREMENTS, *rows)
            self.rows += rows
            self.of_solver[first.solver] += rows
            for row in rows:
                self.display.finished(row)

    def tasks(self, remaining: list[Measurement]) -> Iterator[tuple[Pending, Task] | None]:
        """One task after another; a scene is opened before its first task of a family of forms."""
        opened: dict[str, ReferenceProblem] = {}  # of the current scene: condensed, or sparse
        for batch in self.due(remaining):
            if batch is None:
                yield None
                continue
            m = batch[0]
            if any(problem.scene.name != m.scene for problem in opened.values()):
                opened = {}
            family = form_family(m.form)
            if family not in opened:
                with self.display.step(m.scene):
                    limit_s = m.suite.reference_limit_s
                    opened[family] = measurable(m.source, self.display, limit_s, m.form)
            problem = opened[family]
            _ = in_form(problem.prepared, m.form).arrays  # made before the clock starts
            self.display.progress(f"{m.scene}: {m.solver} {m.form}")
            task = Task(batch, self.solvers[m.solver, m.entry.label], problem.scene_key)
            self.running[m.key] = m
            yield (task, problem), task

    def due(self, remaining: list[Measurement]) -> Iterator[list[Measurement] | None]:
        """The batches that are still needed when their turn comes, and rounds before what is not ours; None
        where all that is left depends on rows that are being made.
        """
        began = dict[str, datetime]()  # the last round on each scene
        waiting = batches(remaining)
        while waiting:
            place = self.next_place(waiting)
            if place is None:
                yield None
                continue
            batch = waiting.pop(place)
            m = still_needed(batch[0], self.of_solver[batch[0].solver])
            if m is None or (m.searched and cell_of(m) in self.lost):
                self.display.advance(len(batch))
                continue
            ours = m.entry.beside or self.solvers[m.solver, m.entry.label].owner == "ours"
            if ours or not any(entry.beside for entry in m.suite.solver):
                yield [m, *batch[1:]]
                continue
            now = datetime.now(UTC)
            if m.scene not in began or now - began[m.scene] > ROUND_LASTS:
                again = round_beside(m, now.isoformat(timespec="seconds"))
                began[m.scene] = now
                self.display.added(len(again))
                yield from ([each] for each in again)
            yield [replace(m, beside_round=began[m.scene].isoformat(timespec="seconds"))]

    def next_place(self, waiting: Sequence[Sequence[Measurement]]) -> int | None:
        """The first that depends on nothing that is being measured or waits before it; None if all do."""
        undecided = set[Cell]().union(*map(decides_on, self.running.values()))
        for place, batch in enumerate(waiting):
            if not undecided & decided_by(batch[0]):
                return place
            undecided |= decides_on(batch[0])
        return None


def batches(remaining: list[Measurement]) -> list[list[Measurement]]:
    """The measurements that one process makes: one each, or the load cases of a series."""
    of_process: dict[object, list[Measurement]] = {}
    for m in remaining:
        of_process.setdefault(m.key if m.case is None else m.process, []).append(m)
    return list(of_process.values())


def record_machine(directory: Path, facts: dict[str, Any]) -> str:
    """Write DIRECTORY/machine.json and return the machine's name.

    The file of another machine is kept under another name.
    """
    file = directory / "machine.json"
    for path in sorted(directory.glob("machine*.json")):
        with suppress(OSError, ValueError):
            if records.parsed(path.read_bytes()).get("machine") == facts["machine"]:
                file = path
                break
            if path == file:
                others = (path.with_name(f"machine-{k}.json") for k in count(1))
                path.rename(next(other for other in others if not other.exists()))
    records.replace_object(file, facts)
    return str(facts["machine"])


def summary(rows: list[Row], console: Console) -> int:
    """Print how many rows there are of each verdict; the exit code, 3 if none could be judged."""
    counts = Counter(row["verdict"] for row in rows)
    words = (f"{count} {verdict.replace('_', ' ')}" for verdict, count in counts.items())
    console.print(f"Verdicts: {', '.join(words) or 'none'}.")
    if counts["within"] + counts["outside"]:
        return DONE
    why = "no row has an answer"
    if unjudged := [row for row in rows if row["verdict"] == "cannot_be_judged"]:
        bounds = (row.get("reference_bound_mm") for row in unjudged)  # null is an infinite one
        least = min(inf if bound is None else bound for bound in bounds)
        proven = "no reference is proven"
        if least < inf:
            proven = f"the references are proven to {upwards(least, 1)} mm"
        why = f"{proven}, and a tenth of the limit is needed"
    console.print(f"Nothing could be judged: {why}.", style="red")
    return NOTHING_JUDGED
