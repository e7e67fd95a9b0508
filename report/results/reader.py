"""What a results directory holds, read into data frames.

`rows` has a line a measurement, `cells` a line a scene and solver (form, variant, tolerance,
threads): the repeats of a cell are merged so that nothing is made to look better than it was.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from report.document.numbers import tidy_power

from .labels import named

TIMES = ("convert_s", "prepare_s", "setup_s", "solve_s", "form_s")
NUMBERS = (
    *("n", "m", "active", "tolerance", "threads", "repeat", "case", "iterations", "inner_iterations"),
    *TIMES,
    *("solver_reported_s", "displacement_error_mm", "limit_mm", "reference_bound_mm", "contact_mismatch"),
    *("min_gap_mm", "primal_residual", "dual_residual", "duality_gap", "peak_rss_mib"),
    *("threads_asked", "load_s", "overhead_s", "time_limit_s", "memory_limit_mib", "data_mib"),
    *("limit_asked_mm", "backward_error", "cholesky_s", "product_s", "together", "warm"),
)
TEXTS = (
    *("key", "suite", "scene", "solver", "form", "variant", "status", "verdict", "machine"),
    *("message", "kernels", "solver_version", "rivetbench_version", "recorded_at"),
)
CELL = ["machine", "scene", "solver", "form", "variant", "tolerance", "threads"]

MEDIANS = [*TIMES, "iterations", "inner_iterations", "solver_reported_s", "cholesky_s", "product_s"]
LARGEST = ["displacement_error_mm", "contact_mismatch", "peak_rss_mib", "working_mib"]

#: How the names of the ladders' rungs begin, hard/<ladder>/<rung>.
RUNGS = "hard/"

#: From best to worst: a cell takes the worst verdict of its repeats.
VERDICTS = ("within", "outside", "cannot_be_judged", "no_answer")
ANSWERED = VERDICTS[:3]


@dataclass(frozen=True)
class Results:
    """One directory of results; `rows` and `cells` as above, the rest as read from its files."""

    directory: Path
    rows: pd.DataFrame
    cells: pd.DataFrame
    problems: pd.DataFrame
    suite: dict[str, Any] = field(default_factory=dict)
    machines: dict[str, dict[str, Any]] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def sizes(self) -> list[int]:
        return sorted({int(n) for n in self.cells["n"].dropna()})

    @property
    def limit(self) -> str:
        """The accuracy asked for, as text: '1e-7 mm'."""
        limits = sorted(self.rows["limit_asked_mm"].dropna().unique())
        return " / ".join(tidy_power(limit) for limit in limits or [1e-7]) + " mm"

    def of_size(self, n: int) -> pd.DataFrame:
        """The cells of one size that were attempted (a form that a solver does not take is not)."""
        return self.cells[(self.cells["n"] == n) & (self.cells["status"] != "unsupported")]

    def scene_arrays(self, scene: str) -> dict[str, NDArray[np.float64]] | None:
        """The arrays of a scene's file; empty where it is damaged, None without a file or contact nodes."""
        path = self.directory / "scenes" / (scene.replace("/", "_") + ".npz")
        if not path.exists():
            return None
        try:
            with np.load(path) as file:
                arrays = {name: file[name] for name in file.files}
        except (OSError, ValueError, BadZipFile):
            return {}
        return arrays if arrays.get("contact_nodes", np.empty(0)).ndim == 2 else None

    def of_rungs(self, wanted: bool) -> Results:
        """The results on the rungs of ladders alone, or on everything else."""
        rows = self.rows[self.rows["scene"].str.startswith(RUNGS) == wanted].reset_index(drop=True)
        return self if len(rows) == len(self.rows) else replace(self, rows=rows, cells=cells_of(rows))

    def of_threads(self, threads: float) -> Results:
        """The results with that number of threads, whose lines then are named without it."""
        rows = self.rows[self.rows["threads"] == threads].reset_index(drop=True)
        return replace(self, rows=rows, cells=cells_of(rows))

    def cells_by_threads(self) -> pd.DataFrame:
        """All cells, each line named without its number of threads: for tables with a column that says it."""
        counts = sorted(self.rows["threads"].dropna().unique())
        return pd.concat([self.of_threads(count).cells for count in counts], ignore_index=True)

    def by_machine(self) -> list[Results]:
        """Results apart for each machine, so that no table or mean can mix two of them."""
        names = self.rows["machine"].unique()
        if len(names) < 2:
            return [self]
        split = [self.rows[self.rows["machine"] == name].reset_index(drop=True) for name in names]
        return [replace(self, rows=rows, cells=cells_of(rows)) for rows in split]


def read(directory: Path) -> Results:
    """Read DIR. Raises FileNotFoundError without DIR/measurements.jsonl; the other files may be missing."""
    path = directory / "measurements.jsonl"
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; a results directory holds measurements.jsonl")
    records, warnings = _json_lines(path)
    scenes, more = _json_lines(directory / "problems.jsonl")
    problems = pd.DataFrame(scenes)
    suite = _loaded(directory / "suite.toml", tomllib.loads, more)
    facts = [_loaded(file, json.loads, more) for file in sorted(directory.glob("machine*.json"))]
    machines = {str(fact.get("machine", "")): fact for fact in facts}
    rows = _frame(records, problems, suite)
    return Results(directory, rows, cells_of(rows), problems, suite, machines, (*warnings, *more))


def _loaded(path: Path, parse: Callable[[str], Any], warnings: list[str]) -> dict[str, Any]:
    """The content of a file; empty, and a warning where it is damaged, if there is none."""
    try:
        content = parse(path.read_text("utf-8")) if path.is_file() else {}
    except ValueError:
        content = None
    if isinstance(content, dict):
        return content
    warnings.append(f"{path.name} could not be read and is left out.")
    return {}


def _json_lines(path: Path) -> tuple[list[dict[str, Any]], list[str]]:
    records: list[dict[str, Any]] = []
    warnings: list[str] = []
    lines = path.read_text("utf-8").splitlines() if path.is_file() else []
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            record = json.loads(line)
        except json.JSONDecodeError:
            record = None
        if isinstance(record, dict):
            records.append(record)
        else:
            warnings.append(f"{path.name}, line {number}, could not be read and is left out.")
    return records, warnings


#: How the message of a row begins that was written without running the solver.
NOT_RUN = "not run:"


def _frame(records: list[dict[str, Any]], problems: pd.DataFrame, suite: dict[str, Any]) -> pd.DataFrame:
    """Rows with the contract's columns always present and of one type each, the last of equal keys."""
    rows = pd.DataFrame(records)
    for name in NUMBERS:
        column = rows[name] if name in rows else pd.Series(np.nan, index=rows.index)
        rows[name] = pd.to_numeric(column, errors="coerce").astype(float)
    for name in TEXTS:
        column = rows[name] if name in rows else pd.Series(None, index=rows.index, dtype=object)
        rows[name] = column.map(_text)
    rows.loc[rows["message"].str.startswith(NOT_RUN, na=False), "status"] = "not_run"
    if "scene" in problems:
        known = problems.drop_duplicates("scene", keep="last").set_index("scene")
        for name in {"n", "m", "active"} & set(known):
            rows[name] = rows[name].fillna(rows["scene"].map(known[name]))
    for name in ("n", "m", "active"):
        rows[name] = rows[name].fillna(rows.groupby("scene")[name].transform("max"))
    rows["limit_asked_mm"] = rows["limit_asked_mm"].fillna(rows["limit_mm"])
    rows["threads"] = rows["threads"].fillna(rows["threads_asked"])
    rows["working_mib"] = rows["peak_rss_mib"] - rows["data_mib"]  # what the solver adds to the data
    options = {solver.get("name"): solver for solver in suite.get("solver", [])}
    for name in ("time_limit_s", "memory_limit_mib"):
        asked = rows["solver"].map(lambda s, key=name: options.get(s, {}).get(key, suite.get(key)))
        rows[name] = rows[name].fillna(pd.to_numeric(asked, errors="coerce"))
    return rows.drop_duplicates([*CELL, "repeat", "case"], keep="last").reset_index(drop=True)


def _text(value: object) -> str:
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return "" if value is None or value != value else str(value)


def cells_of(rows: pd.DataFrame) -> pd.DataFrame:
    """One line a scene and solver. Of its repeats: the worst verdict with its status, the largest error
    and memory, the median of each time over those that have it.

    Adds `load_case_s` = setup + solve + form, what one load case costs, with its `least_s` and `most_s`
    over the repeats; `once_s` = convert + prepare, paid once an assembly; `total_s`, both; `repeats`;
    `label`, the name of the line; and `series`, that name without the tolerance.
    """
    timed = rows["verdict"].isin(ANSWERED) & rows["solve_s"].notna()
    rows = rows.assign(load_case_s=rows[["setup_s", "solve_s", "form_s"]].sum(axis=1).where(timed))
    cell = rows.groupby(CELL, dropna=False, sort=False).ngroup()
    severity = rows["verdict"].map({verdict: i for i, verdict in enumerate(VERDICTS)}).fillna(len(VERDICTS))
    ranked = rows.assign(cell=cell, severity=severity).sort_values("severity", ascending=False, kind="stable")
    cells = ranked.drop_duplicates("cell").set_index("cell").sort_index().drop(columns="severity")
    repeats = rows.groupby(cell)
    cells[MEDIANS] = repeats[MEDIANS].median()
    cells[LARGEST] = repeats[LARGEST].max()
    cells["repeats"] = repeats.size()
    cells["verdict"] = cells["verdict"].where(cells["verdict"].isin(VERDICTS), "no_answer")
    answered = cells["verdict"].isin(ANSWERED) & cells["solve_s"].notna()
    for name, figure in (("load_case_s", "median"), ("least_s", "min"), ("most_s", "max")):
        cells[name] = repeats["load_case_s"].agg(figure).where(answered)
    cells["once_s"] = cells[["convert_s", "prepare_s"]].sum(axis=1).where(answered)
    cells["total_s"] = cells["load_case_s"] + cells["once_s"]
    return named(cells)
