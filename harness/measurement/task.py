"""One task: measurements made by one process, here or on a worker of a scheduler, and their rows."""

import tempfile
import time
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from harness.planning.plan import Measurement
from harness.results import records
from harness.results.provenance import installed_version, machine, provenance
from harness.results.records import Row
from harness.results.schema import MEASURED, STEPS, MeasurementRow, Origin, Provenance
from harness.solving.solver_version import CHANGED, refuse_other_version
from harness.verification.judge import Judgement
from harness.verification.reference_problem import ReferenceProblem
from problems.build import prepared
from problems.errors import InputError
from problems.forms.problem import in_form
from problems.scene_files import read_scene
from report.document.numbers import upwards

from .solver_descriptions import Description
from .worker import FinishedReport, measure, scene_to_measure


@dataclass(frozen=True)
class Task:
    """The work of one process: a measurement, or load cases of a series.

    scene_key : that of the scene on whose reference the answers are judged.
    """

    batch: list[Measurement]
    solver: Description
    scene_key: str


@dataclass(frozen=True)
class TaskResult:
    """The measuring process's part of each row, and the seconds in all.

    files, machine, code : from a worker of a scheduler, with None for an answer that has no file.
    """

    reports: list[FinishedReport]
    elapsed_s: float
    files: list[bytes | None] | None = None
    machine: dict[str, Any] | None = None
    code: Provenance | None = None


def run_task(task: Task, answers: Path) -> TaskResult:
    """Measure; the answer files go into the directory `answers`.

    Raises InputError if the file of the scene is another than that on which they are judged, or the solver
    has another version than the rows would have.
    """
    first = task.batch[0]
    start, batch, forms = time.monotonic(), task.batch, task.solver.forms
    reports: list[FinishedReport]
    if task.solver.failure:
        reports = [{"status": "failed", "message": task.solver.failure}] * len(batch)
    elif first.form in forms:
        reports = measure(batch, [answers / f"{m.stem}.npz" for m in batch])
        if "version" in reports[0] and not first.entry.requirements:
            refuse_other_version(first.solver, first.suite.plugin, reports[0]["version"], task.solver.version)
    else:
        reports = [{"status": "unsupported", "message": f"takes {' and '.join(forms)} only"}] * len(batch)
    elapsed_s = time.monotonic() - start
    scene = read_scene(first.source)  # only now: it may have changed before the process read it
    if scene.sources and scene.key != task.scene_key:
        allowed = f"the file that the run has read: {CHANGED}"
        raise InputError.one(first.source, "scene", "another", allowed)
    return TaskResult(reports, elapsed_s)


def run_task_on_worker(task: Task) -> TaskResult:
    """Measure on a worker of a scheduler, which has the assembly in its own cache, or builds it first."""
    first = task.batch[0]
    scene = scene_to_measure(task.batch)
    _ = in_form(prepared(scene, form=first.form), first.form).arrays  # made before the clock starts
    with tempfile.TemporaryDirectory() as folder:
        result = run_task(task, Path(folder))
        paths = [Path(folder) / f"{m.stem}.npz" for m in task.batch]
        files = [path.read_bytes() if path.exists() else None for path in paths]
    return replace(result, files=files, machine=machine(), code=provenance())


def rows_of(
    task: Task, result: TaskResult, problem: ReferenceProblem, directory: Path, origin: Origin
) -> list[Row]:
    """The rows of a task, its answers judged. Raises OSError if one could not be saved: that is no failure of
    its solver.
    """
    for report in result.reports:
        if "cannot_save" in report:
            raise OSError(report["cannot_save"])
    answers = [directory / "answers" / f"{m.stem}.npz" for m in task.batch]
    for answer, content in zip(answers, result.files or (), strict=bool(result.files)):
        if content is not None:
            answer.write_bytes(content)
    cases = zip(task.batch, answers, result.reports, strict=True)
    log = f"logs/{task.batch[0].stem}.txt" if (printed := result.reports[0].get("printed")) else None
    if log and printed:
        records.replace_text(directory / log, printed)
    rows = [_row(*case, task.solver, problem, result.elapsed_s, origin) for case in cases]
    return [row | {"log": log} for row in rows]


def why_not_judged(judgement: Judgement, problem: ReferenceProblem) -> str | None:
    if judgement.verdict != "cannot_be_judged":
        return None
    return f"reference error bound {upwards(problem.reference.bound_mm, 1)} mm: {problem.reference.route}"


def _row(
    m: Measurement,
    answer: Path,
    report: FinishedReport,
    solver: Description,
    problem: ReferenceProblem,
    elapsed_s: float,
    origin: Origin,
) -> Row:
    """The row of one measurement. An answer of ours may be the first candidate of a reference."""
    series = m.series.model_dump() if m.series else None
    problem = problem.of_case(series, m.case)
    if report.get("answer") and report["status"] == "solved" and solver.owner == "ours":
        problem.add_candidate(m.solver, answer)
    limit_mm = problem.limit_mm(m.suite.limit_mm)
    judgement = Judgement("no_answer", problem.reference.bound_mm)
    if report.get("answer"):
        judgement = problem.judge_file(answer, limit_mm)
    row: MeasurementRow = {
        "key": m.key,
        "suite": m.suite.name,
        "scene": m.scene,
        "source": m.source,
        "solver": m.solver,
        "owner": solver.owner,
        "form": m.form,
        "variant": m.variant,
        "n": problem.prepared.assembly.junction_size,
        "m": problem.prepared.assembly.m,
        "active": int(problem.reference.active.sum()),
        "tolerance": m.tolerance,
        "iteration_limit": m.iteration_limit,
        "searched": m.searched,
        "repeat": m.repeat,
        "round": m.round or None,
        "beside_round": m.beside_round or None,
        "options": m.entry.options,
        "gated": m.entry.gated and not m.round,
        "limit_mm": limit_mm,
        "limit_asked_mm": m.suite.limit_mm,
        "threads_asked": m.threads,
        "batched_asked": m.entry.batched,
        "time_limit_s": m.time_limit_s,
        "memory_limit_mib": m.suite.memory_limit_mib,
        **origin,
        "scene_key": problem.scene_key,
        "solver_version": solver.version,
        "solver_code": solver.code,
        "rivetbench_version": installed_version("rivetbench"),
        "recorded_at": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    measured: Row = {name: report.get(name) for name in MEASURED}
    if m.case is None:
        row["overhead_s"] = elapsed_s - sum(measured[name] or 0.0 for name in ("load_s", *STEPS))
    else:
        row |= {"case": m.case, "series": series}
    return {
        **row,
        **measured,
        **asdict(judgement),
        "message": why_not_judged(judgement, problem) or report.get("message"),
    }
