"""The rows that count: of a search for a tolerance, those that it keeps, and none that a trace stopped."""

from __future__ import annotations

import json
from collections.abc import Sequence

import pandas as pd

from .comparison import measurement
from .records import Row


def chosen(rows: pd.DataFrame, line: Sequence[str]) -> pd.Series[bool]:
    """The rows to keep: a search keeps its loosest tolerance within the limit, or else the tightest.

    line : the columns that distinguish one search from another, beside the machine: workers on several
    machines share a search. Only rows of several runs, put together by `merge`, have the same measurement on
    two machines; then each machine has searches of its own.
    """
    searched, first = rows["searched"] == 1.0, rows["repeat"] == 0
    if not searched.any():
        return ~searched
    within = rows["tolerance"].where(first & (rows["verdict"] == "within"))
    merged = rows[searched].duplicated([*line, "tolerance", "repeat"]).any()
    search = [*line, *(["machine"] if merged else [])]
    by_line = rows.assign(within=within).groupby(search, dropna=False)
    best, last = by_line["within"].transform("max"), by_line["tolerance"].transform("min")
    return ~searched | (rows["tolerance"] == best.fillna(last))


def counting(rows: Sequence[Row]) -> list[Row]:
    """The rows that count, in their order."""
    whole = [row for row in rows if row.get("iteration_limit") is None]
    columns = ["searched", "repeat", "verdict", "tolerance", "machine"]
    table = pd.DataFrame(whole, columns=columns)
    options = [json.dumps(row.get("options"), sort_keys=True) for row in whole]
    lines = [measurement(row | {"searched": True}) for row in whole]
    kept = chosen(table.assign(line=lines, options=options), ["line", "options"])
    return [row for row, keep in zip(whole, kept, strict=True) if keep]
