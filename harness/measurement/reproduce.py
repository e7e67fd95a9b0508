"""One row of a results directory measured again: same scene, solver, options, form, tolerance and threads.

A load case of a series is solved after those before it in the same process, as it was then: its warm start is
part of the measurement.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from harness.planning.plan import Measurement
from harness.planning.suite import RandomCases, read_written
from harness.results.incomparable import Incomparable
from harness.results.kinds import refuse_wrong_kinds
from harness.results.machine import machine
from harness.results.provenance import provenance
from harness.results.records import MEASUREMENTS, Row, read, read_arrays
from harness.results.schema import FIELDS
from harness.results.sides import batched
from harness.verification.reference_problem import reference_problem
from problems.errors import Fault, InputError
from problems.scene import read_scene

from .describe import described
from .row import Task, TaskResult, rows_of, run_task

NEEDED = (
    *("key", "suite", "scene", "source", "scene_key", "solver", "form", "options", "tolerance", "repeat"),
    *("threads_asked", "limit_mm", "time_limit_s", "memory_limit_mib", "status", "verdict"),
)
SHOWN = 10  # keys, where several fit


@dataclass(frozen=True)
class Reproduced:
    """A row as it was and as it is now. moved_mm : between both x, if the old one was kept."""

    then: Row
    now: Row
    moved_mm: float | None


def find_row(directory: Path, words: Sequence[str]) -> Row:
    """The row whose key is these words, or the only one whose key has them all, the first of its repeats.

    Raises InputError.
    """
    path = directory / MEASUREMENTS
    if not path.is_file():
        raise InputError.one("DIR", "directory", str(directory), f"has no {path.name}; `run` creates one")
    rows = read(path)
    refuse_wrong_kinds(path, rows, needed=NEEDED)
    wanted = " ".join(words)
    exact = [row for row in rows if row["key"] == wanted]
    fit = exact or [row for row in rows if set(wanted.split()) <= set(row["key"].split())]
    if not fit:
        raise InputError.one(path, "key", wanted, "words of one key, as in the rows and in `compare`")
    if len({re.sub(r" repeat=\d+", "", row["key"]) for row in fit}) > 1:
        more = f", and {len(fit) - SHOWN} more" if len(fit) > SHOWN else ""
        some = "; ".join(row["key"] for row in fit[:SHOWN])
        raise InputError.one(path, "key", wanted, f"more words: {some}{more}")
    numbers = {name: value for name, value in fit[0].items() if name in NEEDED and FIELDS[name] == "number"}
    faults = [
        Fault(str(path), f"{name} of {fit[0]['key']}", value, "must be finite")
        for name, value in numbers.items()
        if not isfinite(value)
    ]
    if faults:
        raise InputError(faults)
    return fit[0]


def reproduce(
    directory: Path, words: Sequence[str], plugin: Path | None, doing: Callable[[str], None]
) -> Reproduced:
    """Measure the row again. plugin : of the row's solver, by default that of the directory's suite.

    Raises InputError, Incomparable if the scene is another problem now.
    """
    then = find_row(directory, words)
    scene = read_scene(then["source"])
    if scene.key != then["scene_key"]:
        allowed = f"the scene is another problem now, of the key {scene.key}"
        raise Incomparable.one(
            directory / MEASUREMENTS, f"scene_key of {then['key']}", then["scene_key"], allowed
        )
    suite = directory / "suite.toml"
    if plugin is None and suite.is_file():
        plugin = _plugin_of(suite, then["solver"])
    (solver,) = described([(then["solver"], then["options"])], plugin, "reproduce", doing)
    rows = of_one_process(directory, then)
    batch, place = [_measurement(row, plugin) for row in rows], rows.index(then)
    doing(f"opening {scene.name}")
    problem = reference_problem(then["source"], form=then["form"])
    doing(f"measuring {then['key']}")
    with TemporaryDirectory() as folder:
        answers = Path(folder) / "answers"
        answers.mkdir()
        result = run_task(Task(batch, solver), answers)
        last = TaskResult([result.reports[place]], result.elapsed_s)
        origin: Row = {"machine": machine()["machine"], **provenance()}
        (now,) = rows_of(Task([batch[place]], solver), last, problem, Path(folder), origin)
        x, old = _x(Path(folder), now), _x(directory, then)
    moved = None if x is None or old is None or x.shape != old.shape else x - old
    assembly = problem.prepared.assembly
    moved_mm = None if moved is None else float(abs(assembly.at_junction(moved)).max(initial=0.0))
    return Reproduced(then, now, moved_mm)


def _plugin_of(suite: Path, solver: str) -> Path | None:
    plugin = read_written(suite).plugin
    return Path(plugin) if plugin and Path(plugin).stem == solver else None


def of_one_process(directory: Path, then: Row) -> list[Row]:
    """The row, or the load cases of its series up to it, whole batches, in order."""
    if then.get("case") is None:
        return [then]
    names = ("scene", "solver", "form", "variant", "tolerance", "threads_asked", "repeat")
    same = [
        row
        for row in read(directory / MEASUREMENTS)
        if row.get("case") is not None
        and all(row.get(name) == then.get(name) for name in names)
        and batched(row) == batched(then)
    ]
    size = batched(then) or 1
    end = (int(then["case"]) // size + 1) * size
    return sorted((row for row in same if row["case"] < end), key=lambda row: int(row["case"]))


def _measurement(row: Row, plugin: Path | None) -> Measurement:
    case = row.get("case")
    return Measurement(
        **{
            name: row[name] for name in ("suite", "scene", "source", "solver", "form", "options", "tolerance")
        },
        variant=row.get("variant") or "",
        threads=int(row["threads_asked"]),
        repeat=int(row["repeat"]),
        time_limit_s=row["time_limit_s"],
        memory_limit_mib=int(row["memory_limit_mib"]),
        limit_mm=row.get("limit_asked_mm") or row["limit_mm"],
        gated=bool(row.get("gated")),
        plugin=None if plugin is None else str(plugin),
        yardstick=row.get("cholesky_s") is not None,
        series=RandomCases(**row["series"]) if row.get("series") else None,
        case=None if case is None else int(case),
        batched=batched(row),
    )


def _x(directory: Path, row: Row) -> np.ndarray | None:
    """The displacements of a row's answer, if it is there and whole."""
    if not row.get("answer"):
        return None
    try:
        return read_arrays(directory / row["answer"])["x"]
    except (OSError, ValueError, KeyError):
        return None
