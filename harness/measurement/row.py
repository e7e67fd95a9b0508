"""Measurements, made here or on a worker of a scheduler, and the rows that come of them."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from harness.planning.plan import Measurement
from harness.results.machine import installed_version, machine
from harness.results.provenance import provenance
from harness.results.records import Row
from harness.results.schema import MEASURED, MEASURED_OF_CASES, STEPS
from harness.verification.ground_truth import Ground
from harness.verification.judge import Judgement
from problems.build import prepared
from problems.forms.problem import in_form
from problems.scene import read_scene
from solvers.base import Form

from .describe import Description
from .process import measure


@dataclass(frozen=True)
class Order:
    """What one process is to measure: a measurement, or load cases of a series.

    forms : that the solver takes. hopeless : the scene that shows that there is no time.
    """

    batch: list[Measurement]
    forms: Sequence[Form]
    hopeless: str = ""


@dataclass(frozen=True)
class Measured:
    """What the worker processes told, and how long it took.

    From a worker of a scheduler also the answers' files, None where there is none, its machine and its code.
    """

    told: list[Row]
    elapsed_s: float
    files: list[bytes | None] | None = None
    machine: dict[str, Any] | None = None
    code: Row | None = None


def measured(order: Order, answers: Path) -> Measured:
    """Carry out the order; the answers' files go into that directory."""
    start, batch = time.monotonic(), order.batch
    if order.hopeless:
        not_run: Row = {"status": "not_run", "message": f"too slow already on {order.hopeless}"}
        told = [not_run] * len(batch)
    elif batch[0].form in order.forms:
        told = measure(batch, [answers / f"{m.stem}.npz" for m in batch])
    else:
        told = [{"status": "unsupported", "message": f"takes {' and '.join(order.forms)} only"}] * len(batch)
    return Measured(told, time.monotonic() - start)


def measured_on_worker(order: Order) -> Measured:
    """The same on a worker of a scheduler, which has the assembly in its own cache, or builds it first."""
    due = order.batch[0]
    _ = in_form(prepared(read_scene(due.source)), due.form).arrays  # made before the clock starts
    with tempfile.TemporaryDirectory() as folder:
        made = measured(order, Path(folder))
        paths = [Path(folder) / f"{m.stem}.npz" for m in order.batch]
        files = [path.read_bytes() if path.exists() else None for path in paths]
    return Measured(made.told, made.elapsed_s, files, machine(), provenance())


def rows_of(
    batch: list[Measurement], made: Measured, base: Ground, directory: Path, solver: Description, here: Row
) -> list[Row]:
    """Judge what was measured, and put together the rows."""
    answers = [directory / "answers" / f"{m.stem}.npz" for m in batch]
    for answer, content in zip(answers, made.files or (), strict=bool(made.files)):
        if content is not None:
            answer.write_bytes(content)
    return [
        one_row(m, answer, said, base, solver, here, made.elapsed_s)
        for m, answer, said in zip(batch, answers, made.told, strict=True)
    ]


def one_row(
    m: Measurement, answer: Path, told: Row, base: Ground, solver: Description, here: Row, elapsed: float
) -> Row:
    """The row of a measurement of which the worker told that. here : its `machine`, `commit` and `clean`."""
    if "cannot_save" in told:
        raise OSError(told["cannot_save"])
    series = m.series.model_dump() if m.series else None
    base = base.of_case(series, m.case)
    limit_mm, judgement = base.limit_mm(m.limit_mm), Judgement("no_answer", base.reference.bound_mm)
    if told.get("answer"):
        judgement = base.judge_file(answer, limit_mm)
    of_series: Row = {
        "case": m.case,
        "series": series,
        **{name: told.get(name) for name in MEASURED_OF_CASES},
    }
    if m.case is None:
        of_series = {}
    told = {name: told.get(name) for name in MEASURED}
    known = [told[name] for name in ("load_s", *STEPS) if told[name] is not None]
    return {
        "key": m.key,
        **{name: getattr(m, name) for name in ("suite", "scene", "source", "solver", "form", "variant")},
        "n": base.prepared.assembly.n,
        "m": base.prepared.assembly.m,
        "active": int(base.reference.active.sum()),
        **{name: getattr(m, name) for name in ("tolerance", "repeat", "options", "gated")},
        "limit_mm": limit_mm,
        "limit_asked_mm": m.limit_mm,
        **of_series,
        "threads_asked": m.threads,
        **told,
        **asdict(judgement),
        **{name: getattr(m, name) for name in ("time_limit_s", "memory_limit_mib")},
        "overhead_s": elapsed - sum(known) if m.case is None else None,
        **here,
        "scene_key": base.scene.key,
        "in_house": solver.in_house,
        "solver_version": solver.version,
        "solver_code": solver.code,
        "rivetbench_version": installed_version("rivetbench"),
        "recorded_at": datetime.now(UTC).isoformat(timespec="seconds"),
    }
