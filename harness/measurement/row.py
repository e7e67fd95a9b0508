"""One task: measurements made by one process, here or on a worker of a scheduler, and their rows."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from harness.planning.plan import Measurement
from harness.results.machine import installed_version, machine
from harness.results.provenance import provenance
from harness.results.records import Row
from harness.results.schema import MEASURED, MEASURED_OF_CASES, STEPS
from harness.verification.judge import Judgement
from harness.verification.reference_problem import ReferenceProblem
from problems.build import prepared
from problems.forms.problem import in_form
from problems.scene import read_scene
from solvers.base import Form

from .describe import Description
from .process import measure


@dataclass(frozen=True)
class Task:
    """What one process measures: a measurement, or load cases of a series.

    forms : those that the solver takes. timed_out_on : the scenes that predict a timeout; "" if none do.
    """

    batch: list[Measurement]
    forms: Sequence[Form]
    timed_out_on: str = ""


@dataclass(frozen=True)
class TaskResult:
    """The measuring process's part of each row, and the seconds in all.

    From a worker of a scheduler also the answer files (None where there is none), its machine and its code.
    """

    reports: list[Row]
    elapsed_s: float
    files: list[bytes | None] | None = None
    machine: dict[str, Any] | None = None
    code: Row | None = None


def run_task(task: Task, answers: Path) -> TaskResult:
    """Measure; the answer files go into that directory."""
    start, batch = time.monotonic(), task.batch
    if task.timed_out_on:
        not_run: Row = {"status": "not_run", "message": f"too slow already on {task.timed_out_on}"}
        reports = [not_run] * len(batch)
    elif batch[0].form in task.forms:
        reports = measure(batch, [answers / f"{m.stem}.npz" for m in batch])
    else:
        unsupported: Row = {"status": "unsupported", "message": f"takes {' and '.join(task.forms)} only"}
        reports = [unsupported] * len(batch)
    return TaskResult(reports, time.monotonic() - start)


def run_task_on_worker(task: Task) -> TaskResult:
    """The same on a worker of a scheduler, which has the assembly in its own cache, or builds it first."""
    first = task.batch[0]
    _ = in_form(prepared(read_scene(first.source)), first.form).arrays  # made before the clock starts
    with tempfile.TemporaryDirectory() as folder:
        result = run_task(task, Path(folder))
        paths = [Path(folder) / f"{m.stem}.npz" for m in task.batch]
        files = [path.read_bytes() if path.exists() else None for path in paths]
    return replace(result, files=files, machine=machine(), code=provenance())


def rows_of(
    batch: list[Measurement],
    result: TaskResult,
    problem: ReferenceProblem,
    directory: Path,
    solver: Description,
    origin: Row,
) -> list[Row]:
    """The rows of a batch, its answers judged. origin : their `machine`, `commit`, `clean`."""
    answers = [directory / "answers" / f"{m.stem}.npz" for m in batch]
    for answer, content in zip(answers, result.files or (), strict=bool(result.files)):
        if content is not None:
            answer.write_bytes(content)
    rows = []
    for m, answer, report in zip(batch, answers, result.reports, strict=True):
        if "cannot_save" in report:
            raise OSError(report["cannot_save"])
        rows.append(_row(m, answer, report, problem, solver, origin, result.elapsed_s))
    return rows


def _row(
    m: Measurement,
    answer: Path,
    report: Row,
    problem: ReferenceProblem,
    solver: Description,
    origin: Row,
    elapsed_s: float,
) -> Row:
    """The row of one measurement."""
    series = m.series.model_dump() if m.series else None
    problem = problem.of_case(series, m.case)
    limit_mm, judgement = problem.limit_mm(m.limit_mm), Judgement("no_answer", problem.reference.bound_mm)
    if report.get("answer"):
        judgement = problem.judge_file(answer, limit_mm)
    of_case: Row = {}
    if m.case is not None:
        of_case = {"case": m.case, "series": series} | {name: report.get(name) for name in MEASURED_OF_CASES}
    measured: Row = {name: report.get(name) for name in MEASURED}
    steps = [measured[name] for name in ("load_s", *STEPS) if measured[name] is not None]
    return {
        "key": m.key,
        **{name: getattr(m, name) for name in ("suite", "scene", "source", "solver", "form", "variant")},
        "n": problem.prepared.assembly.n,
        "m": problem.prepared.assembly.m,
        "active": int(problem.reference.active.sum()),
        **{name: getattr(m, name) for name in ("tolerance", "repeat", "options", "gated")},
        "limit_mm": limit_mm,
        "limit_asked_mm": m.limit_mm,
        **of_case,
        "threads_asked": m.threads,
        **measured,
        **asdict(judgement),
        **{name: getattr(m, name) for name in ("time_limit_s", "memory_limit_mib")},
        "overhead_s": elapsed_s - sum(steps) if m.case is None else None,
        **origin,
        "scene_key": problem.scene.key,
        "in_house": solver.in_house,
        "solver_version": solver.version,
        "solver_code": solver.code,
        "rivetbench_version": installed_version("rivetbench"),
        "recorded_at": datetime.now(UTC).isoformat(timespec="seconds"),
    }
