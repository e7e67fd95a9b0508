"""From what a worker tells to rows: judged, with all that the contract names."""

from __future__ import annotations

import time
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

from .describe import Description
from .ground import Ground
from .judge import Judgement
from .machine import installed_version
from .measure import measure
from .plan import Measurement
from .records import Row

#: A row's fields that the worker tells of; null where it does not.
TOLD = (
    *("status", "message", "iterations", "inner_iterations", "convert_s", "prepare_s", "setup_s", "solve_s"),
    *("form_s", "load_s", "solver_reported_s", "data_mib", "peak_rss_mib", "threads", "kernels", "details"),
    *("cholesky_s", "product_s", "stderr", "answer"),
)
CLOCKS = ("load_s", "form_s", "convert_s", "prepare_s", "setup_s", "solve_s")


def rows_of(
    batch: list[Measurement],
    base: Ground,
    directory: Path,
    solver: Description,
    here: str,
    hopeless: str = "",
) -> list[Row]:
    """Measure, judge, and put together the rows. hopeless : the scene that shows that there is no time."""
    start = time.monotonic()
    answers = [directory / "answers" / f"{m.stem}.npz" for m in batch]
    if hopeless:
        not_run: Row = {"status": "time_limit", "message": f"not run: too slow already on {hopeless}"}
        told = [not_run] * len(batch)
    elif batch[0].form in solver.forms:
        told = measure(batch, answers)
    else:
        told = [{"status": "unsupported", "message": f"takes {' and '.join(solver.forms)} only"}] * len(batch)
    elapsed = time.monotonic() - start
    return [
        one_row(m, answer, said, base, solver, here, elapsed)
        for m, answer, said in zip(batch, answers, told, strict=True)
    ]


def one_row(
    m: Measurement, answer: Path, told: Row, base: Ground, solver: Description, here: str, elapsed: float
) -> Row:
    """The row of a measurement of which the worker told that."""
    if "cannot_save" in told:
        raise OSError(told["cannot_save"])
    series = m.series.model_dump() if m.series else None
    base = base.of_case(series, m.case)
    limit_mm, judgement = base.limit_mm(m.limit_mm), Judgement("no_answer", base.reference.bound_mm)
    if told.get("answer"):
        judgement = base.judge_file(answer, limit_mm)
    told = {name: told.get(name) for name in TOLD}
    known = [told[name] for name in CLOCKS if told[name] is not None]
    return {
        "key": m.key,
        **{name: getattr(m, name) for name in ("suite", "scene", "source", "solver", "form", "variant")},
        "n": base.prepared.assembly.n,
        "m": base.prepared.assembly.m,
        "active": int(base.reference.active.sum()),
        **{name: getattr(m, name) for name in ("tolerance", "repeat", "options", "gated")},
        "limit_mm": limit_mm,
        "limit_asked_mm": m.limit_mm,
        **({} if m.case is None else {"case": m.case, "series": series}),
        "threads_asked": m.threads,
        **told,
        **asdict(judgement),
        **{name: getattr(m, name) for name in ("time_limit_s", "memory_limit_mib")},
        "overhead_s": elapsed - sum(known) if m.case is None else None,
        "machine": here,
        "scene_key": base.scene.key,
        "solver_version": solver.version,
        "solver_code": solver.code,
        "rivetbench_version": installed_version("rivetbench"),
        "recorded_at": datetime.now(UTC).isoformat(timespec="seconds"),
    }
