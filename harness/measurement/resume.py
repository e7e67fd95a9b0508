"""Which rows of an earlier run are still valid: of the same scene, solver, code and accuracy."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from harness.planning.due import OUT_OF_TIME
from harness.planning.plan import Measurement
from harness.results import records
from harness.results.kinds import refuse_wrong_kinds
from harness.results.records import Row
from problems.scene import read_scene

from .describe import Description, Solvers

NEEDED = ("key", "scene", "status", "time_limit_s", "memory_limit_mib")


def resumed(directory: Path, plan: list[Measurement], solvers: Solvers, console: Console) -> list[Row]:
    """The valid rows of DIRECTORY; outdated ones are moved to a file of their own."""
    path = directory / records.MEASUREMENTS
    if records.remove_torn_line(path):
        console.print(f"{path}: the last line was torn, and is measured again", style="yellow")
    rows = records.read(path)
    refuse_wrong_kinds(path, rows, needed=NEEDED)
    planned = {m.key: m for m in plan}
    sources = {m.scene: m.source for m in plan}
    scene_keys = {name: read_scene(source).key for name, source in sources.items()}

    def is_old(row: Row) -> bool:
        m = planned.get(row["key"])
        return m is not None and outdated(row, m, solvers[m.solver, m.variant], scene_keys[m.scene])

    old = [row for row in rows if is_old(row)]
    if old:
        records.append(directory / records.OUTDATED, *(row | {"answer": None} for row in old))
        rows = [row for row in rows if row not in old]
        records.rewrite(path, rows)
        why = "the scene, the solver or the limits have changed since"
        console.print(f"{len(old)} rows are set aside in {records.OUTDATED}: {why}", style="yellow")
    return rows


def outdated(row: Row, m: Measurement, solver: Description, scene_key: str) -> bool:
    """Whether a row is of another scene, series, solver or accuracy, or hit a limit that is wider now."""
    law = m.series.model_dump(exclude={"cases"}) if m.series else {}
    now = (scene_key, solver.version, solver.code, m.limit_mm, m.gated, law)
    asked = row.get("limit_asked_mm", row.get("limit_mm"))  # older rows have one limit only
    drawn = {key: value for key, value in (row.get("series") or {}).items() if key != "cases"}
    solved = (row.get(k) for k in ("scene_key", "solver_version", "solver_code"))
    before = (*solved, asked, row.get("gated"), drawn)
    out_of_time = row["status"] in OUT_OF_TIME and row["time_limit_s"] < m.time_limit_s
    left_behind = m.stop_at_times_fastest is not None and bool(row.get("stop"))
    out_of_memory = row["status"] == "memory_limit" and row["memory_limit_mib"] < m.memory_limit_mib
    return now != before or (out_of_time and not left_behind) or out_of_memory
