"""Solves the cases of a series that DIRECTORY lacks, and writes rows and gaps as they come in.

The same command resumes the series that a directory holds; another series is refused.
"""

import time
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from harness.measurement.scheduler import shared
from harness.results import records, series_file
from harness.results.provenance import installed_version, machine
from harness.results.records import Row, to_line
from harness.results.schema import SERIES, VERDICTS
from harness.terminal import DONE, FAILED, NOTHING_JUDGED
from harness.verification.reference import UNPROVEN
from problems.build import prepared
from problems.errors import InputError
from problems.model.effect import code_of
from problems.model.fastener_forces import fastener_forces
from problems.model.scene import JointScene
from problems.model.stage_answers import last_scene
from problems.storage import fingerprint
from report.document.numbers import counted, upwards

from .executors import results_of
from .session import Job, Result

MISSING, OPEN, KEPT = range(3)  # a case: without a row, to be tried again, with its row
LIMITS = {"time_limit": "time_limit_s", "memory_limit": "memory_limit_mib"}


def run(
    job: Job, facts: dict[str, Any], directory: Path, console: Console, scheduler: str | None = None
) -> int:
    """Solve the remaining cases of a series. `facts`: of the solver; part of its identity.

    Returns 0, 1 if an answer is outside the limit or missing, 3 if one could not be judged. Raises InputError
    if DIRECTORY holds another series; after KeyboardInterrupt the same command resumes.
    """
    with records.locked(directory, SERIES):
        open_series(directory, identity(job) | facts, metadata(job))
        state = states(directory, job)
        remaining = np.flatnonzero(state < KEPT).tolist()
        remaining.sort(key=lambda k: (job.cases.stiffness_of(k), state[k]))
        cases, there = counted(len(state), "case"), len(state) - len(remaining)
        console.print(f"{job.scene.name}: {cases}, {there} already in {directory}")
        with shared(scheduler if remaining else None, console) as address:
            for _, some in groupby(remaining, job.cases.stiffness_of):
                numbers = list(some)
                one_K = job.cases.of_stiffness(numbers[0], job.scene)
                key, scene_key = uuid4().hex, one_K[0].key  # another session
                part = replace(job, scene=one_K[0], cases=one_K[1], key=key, scene_key=scene_key)
                with results_of(part, numbers, address, console) as results:
                    solve_remaining(part, len(numbers), results, directory, console)
        return summary(series_file.rows(directory), job.cases.count, console)


def solve_remaining(
    job: Job, count: int, results: Iterator[list[Result]], directory: Path, console: Console
) -> None:
    """Write the results as they come, and print those without an answer or outside the limit; no other
    process writes.
    """
    record_contacts(job, directory)
    begun, made = time.monotonic(), 0
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, TimeRemainingColumn(), console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task(job.scene.name, total=count)
        for some in results:
            series_file.append(directory, some)
            made += len(some)
            bar.update(task, completed=made)
            for row in (result.row for result in some if result.row["verdict"] in ("outside", "no_answer")):
                why = row["message"] or f"{row.get('displacement_error_mm') or 0:.1e} mm off"
                console.print(f"case {row['case']}: {row['status']}, {row['verdict']}: {why}", style="red")
    console.print(f"{counted(made, 'case')} in {time.monotonic() - begun:.1f} s")


def identity(job: Job) -> dict[str, Any]:
    """The facts that all rows of one series share."""
    effects = job.scene.effects if isinstance(job.scene, JointScene) else ()
    return {
        "scene_key": job.scene.key,
        "effects_code": fingerprint(code_of(effects)),
        "cases_key": job.cases.key,
        "solver": job.solver,
        "options": job.solver_options,
        "form": job.form,
        "tolerance": job.tolerance,
        "limit_mm": job.limit_mm,
        "rivetbench_version": installed_version("rivetbench"),
    }


def metadata(job: Job) -> dict[str, Any]:
    size, scene = job.scene.expected_size, job.cases.scene_of(0)
    return {
        "scene": job.scene.name,
        "title": job.scene.title,
        "cases": job.cases.count,
        "kind": type(job.cases).__name__,
        **job.cases.facts,
        "n": size[0] if size else None,
        "threads": job.threads,
        "check": job.check,
        "fasteners": list(fastener_forces(scene, np.zeros(scene.joint.size[0]))) if scene else [],
        **machine(),
    }


def record_contacts(job: Job, directory: Path) -> None:
    """Record the places of the contacts, and the marks of effects as `fasteners`, for the figures."""
    scene = last_scene(job.scene)
    assembly = prepared(scene, form=job.form).assembly
    arrays = {"m": np.array(assembly.m)}
    if assembly.contact_nodes is not None:
        arrays["contact_nodes"] = assembly.contact_nodes
    if isinstance(scene, JointScene):
        arrays["fasteners"] = scene.marks()
    series_file.write_contacts(directory, arrays)


def open_series(directory: Path, identity: dict[str, Any], facts: dict[str, Any]) -> None:
    """Write identity and facts, without the check of an earlier command.

    Raises InputError, naming each difference, if another series is there.
    """
    before = series_file.read_facts(directory)
    if before is not None:
        records.refuse_other(directory / SERIES, before["identity"], identity)
    series_file.write_fact(directory, "series", to_line({"identity": identity, **facts}))
    if series_file.CHECK in (before or {}):
        for name in series_file.CHECK_FILES:
            (directory / name).unlink(missing_ok=True)


def states(directory: Path, job: Job) -> NDArray[np.int8]:
    """MISSING, OPEN or KEPT for each case, (count,).

    Raises InputError if one has other parameters than its case now, as after a change of a table.
    """
    state = np.full(job.cases.count, MISSING, dtype=np.int8)
    for row in series_file.rows(directory):
        case = row["case"]
        state[case] = OPEN if is_open(row, job) else KEPT
        for name, value in job.cases.parameters(case).items():
            if row.get(name) != value:
                where, allowed = f"case {case}, {name}", f"is now {value!r}: {records.OTHER}"
                raise InputError.one(directory / SERIES, where, row.get(name), allowed)
    return state


def is_open(row: Row, job: Job) -> bool:
    """Whether a case without an answer is tried again: its limit is wider now, or its cause may be over."""
    if limit := LIMITS.get(row.get("status") or ""):
        return bool(row.get(limit, 0) < getattr(job, limit))  # without one, the system had no more memory
    return records.may_pass(row)


def summary(rows: Iterable[Row], cases: int, console: Console) -> int:
    """Print the number of rows of each verdict, the largest proven bound, and the largest error of the cases
    compared with the reference; returns the exit code. cases : how many rows there should be.
    """
    counts = dict.fromkeys(VERDICTS, 0)
    worst_bound, compared, worst_error = 0.0, 0, 0.0
    for row in rows:
        counts[row["verdict"]] += 1
        bound = row.get("bound_mm", 0.0)  # missing without an answer; null in the file where it is infinite
        worst_bound = max(worst_bound, np.inf if bound is None else bound)
        if (error := row.get("displacement_error_mm")) is not None:
            compared, worst_error = compared + 1, max(worst_error, error)
    seen = [f"{count} {verdict.replace('_', ' ')}" for verdict, count in counts.items() if count]
    proven = np.isfinite(worst_bound)
    said = f"largest proven error bound {upwards(worst_bound)} mm" if proven else f"some bounds {UNPROVEN}"
    said += f", largest of {compared} checked {worst_error:.1e} mm" if compared else ""
    console.print(f"{', '.join(seen)}; {said}")
    if missing := cases - sum(counts.values()):
        console.print(f"Not solved: {missing}. Run the same command again.", style="red")
        return FAILED
    if counts["outside"] + counts["no_answer"]:
        return FAILED
    return DONE if counts["within"] == cases else NOTHING_JUDGED
