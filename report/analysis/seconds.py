"""Seconds per load case: what is known without an answer, those of the fastest opponent, their spread."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from harness.results.schema import ANSWERED
from report.document.numbers import MISSING, significant
from report.results.rows import CELL

ROUND = ["scene", "threads"]


def timed(cells: pd.DataFrame) -> pd.DataFrame:
    """With `at_least`: seconds per load case if the answer is within the limit; for a run ended by the time
    limit or an iteration limit, the time it had taken by then; else missing. `cut`: it is only that lower
    bound.
    """
    within = cells["verdict"] == "within"
    late = (cells["status"] == "time_limit") & ~within
    spent = (cells["status"] == "iteration_limit") & ~within
    at_least = cells["load_case_s"].where(within | spent, cells["time_limit_s"].where(late))
    return cells.assign(at_least=at_least, cut=(late | spent) & at_least.notna())


def seconds_text(cell: Mapping[str, Any]) -> str:
    """The seconds per load case, or why there is no answer within the limit."""
    if cell["verdict"] == "within":
        return significant(cell["load_case_s"])
    if cell["verdict"] in ANSWERED:
        return f"{significant(cell['load_case_s'])} ({str(cell['verdict']).replace('_', ' ')})"
    if cell["status"] == "time_limit" and cell["time_limit_s"] > 0:
        return f"> {cell['time_limit_s']:.4g}"
    return str(cell["status"]).replace("_", " ") or MISSING


def of_fastest(owner: str, rows: pd.DataFrame, *names: str) -> pd.Series[float]:
    """For each row the seconds of the fastest solver of that owner on its scene with as many threads: the
    least of the medians of any of the names.
    """
    medians = rows[rows["owner"] == owner].groupby(CELL, dropna=False)[[*names]].median().min(axis=1)
    return rows.join(medians.groupby(ROUND).min().rename("fastest"), on=ROUND)["fastest"]


def spreads(rows: pd.DataFrame, by: list[str], names: list[str]) -> pd.DataFrame:
    """The medians over the groups, and with the endings _least and _most the ranges."""
    found = rows.groupby(by, dropna=False)[names].agg(["median", "min", "max"])
    return found.set_axis([f"{name}{end}" for name in names for end in ("", "_least", "_most")], axis=1)
