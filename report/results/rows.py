"""The rows of a results directory as a data frame with one row per measurement."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from harness.results.schema import of_kind
from report.document.escape import quoted

NUMBERS, TEXTS, FLAGS = of_kind("number"), of_kind("text"), of_kind("flag")
#: What distinguishes the measurements of a run, apart from repeats and the cases of a series.
CELL = ["machine", "scene", "solver", "form", "variant", "tolerance", "threads"]


def frame(records: list[dict[str, Any]], problems: pd.DataFrame, suite: dict[str, Any]) -> pd.DataFrame:
    """The rows with every field of the schema as a column of one type, the last of equal measurements.

    Flags are 1.0, 0.0 or missing. A row without an `owner` has that of its flag `in_house`. Adds
    `working_mib`, what the solver needs on top of the data. The size and the limits of a row that lacks them
    are those of its scene, of `problems` and of the suite.
    """
    rows = pd.DataFrame(records)
    for name in [*NUMBERS, *FLAGS]:
        column = rows[name] if name in rows else pd.Series(np.nan, index=rows.index)
        rows[name] = pd.to_numeric(column, errors="coerce").astype(float)
    for name in TEXTS:
        column = rows[name] if name in rows else pd.Series(None, index=rows.index, dtype=object)
        rows[name] = column.map(_text)
    of_flag = np.where(rows["in_house"] == 1.0, "ours", "library")
    rows["owner"] = rows["owner"].where(rows["owner"] != "", of_flag)
    if "scene" in problems:
        known = problems.drop_duplicates("scene", keep="last").set_index("scene")
        for name in {"n", "m", "active"} & set(known):
            rows[name] = rows[name].fillna(rows["scene"].map(known[name]))
    for name in ("n", "m", "active"):
        rows[name] = rows[name].fillna(rows.groupby("scene")[name].transform("max"))
    rows["limit_asked_mm"] = rows["limit_asked_mm"].fillna(rows["limit_mm"])
    rows["threads"] = rows["threads"].fillna(rows["threads_asked"])
    rows["working_mib"] = rows["peak_rss_mib"] - rows["data_mib"]
    options = {solver.get("name"): solver for solver in suite.get("solver", [])}
    for name in ("time_limit_s", "memory_limit_mib"):
        asked = rows["solver"].map(lambda s, key=name: options.get(s, {}).get(key, suite.get(key)))
        rows[name] = rows[name].fillna(pd.to_numeric(asked, errors="coerce"))
    rows = rows.drop_duplicates([*CELL, "repeat", "case"], keep="last")
    return rows[_chosen(rows)].reset_index(drop=True)


def _chosen(rows: pd.DataFrame) -> pd.Series[bool]:
    """Of a search for a tolerance, the loosest whose answer is within the limit, else the last tried."""
    line = [name for name in CELL if name != "tolerance"]
    searched, first = rows["searched"] == 1.0, rows["repeat"] == 0
    within = rows["tolerance"].where(first & (rows["verdict"] == "within"))
    best = rows.assign(tolerance=within).groupby(line, dropna=False)["tolerance"].transform("max")
    last = rows.groupby(line, dropna=False)["tolerance"].transform("min")
    return ~searched | (rows["tolerance"] == best.fillna(last))


def of_records(records: list[dict[str, Any]]) -> pd.DataFrame:
    """Rows without the scenes and the suite that they belong to, with every text quoted."""
    return frame(quoted(records), pd.DataFrame(), {})


def _text(value: object) -> str:
    return "" if value is None or value != value else str(value)
