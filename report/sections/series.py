"""Series: load cases per second and their errors by solver, also relative to the fastest library."""

from __future__ import annotations

from typing import Any

import pandas as pd

from harness.results.schema import ANSWERED
from report.document.blocks import Column, Section, Table, number, word
from report.document.numbers import power, spread, whole
from report.results.labels import named
from report.results.reader import Results
from report.results.rows import CELL

CASE = ["setup_s", "solve_s", "form_s"]
ROUND = ["scene", "threads"]


def section(results: Results) -> Section | None:
    rows = results.rows[results.rows["case"].notna()]
    if rows.empty:
        return None
    rows = compared(rows)
    lines = pd.DataFrame([_line(group) for _, group in rows.groupby(CELL, dropna=False, sort=False)])
    lines = pd.concat([named(of_round) for _, of_round in lines.groupby(ROUND)])
    lines = lines.sort_values(["n", "scene", "threads", "case_s"])
    columns = [
        word("scene", "scene"),
        number("threads", "threads", whole),
        word("solver (form)", "label"),
        Column("within", lambda row: f"{row['within']} of {row['cases']}"),
        number("s per case", "case_s"),
        number("per assembly, s", "once_s"),
        number("largest error, mm", "error_mm", power),
        Column("time relative to the fastest library", spread("to_library")),
    ]
    caption = (
        "*Load cases on one assembly, in one process*: the median over the cases after the first (of "
        "batches: after the first batch); relative to the fastest library, by its update or from the start, "
        "the median (range)."
    )
    return Section("Series of load cases", [Table("series", caption, lines, columns, keys=3)])


def compared(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of series with `case_s`, the seconds per case; `later_s`, the same if a case was solved before and
    the answer is within the limit; `to_library`, later_s relative to the fastest library, which may take each
    case as its first: the least of the medians of both.
    """
    rows = rows.assign(case_s=rows[CASE].sum(axis=1))
    within = rows["case_s"].where(rows["verdict"] == "within")
    rows["later_s"], cold_s = within.where(rows["warm"] == 1), within.where(rows["warm"] == 0)
    libraries = rows.assign(cold_s=cold_s)[rows["owner"] == "library"].groupby(CELL, dropna=False)
    best = libraries[["later_s", "cold_s"]].median().min(axis=1)
    fastest = best.groupby(ROUND).min().rename("library_s")
    rows = rows.join(fastest, on=ROUND)
    return rows.assign(to_library=rows["later_s"] / rows["library_s"])


def _line(group: pd.DataFrame) -> dict[str, Any]:
    answered = group[group["verdict"].isin(ANSWERED)]
    first, later = answered["warm"] == 0, answered["warm"] == 1
    case_s = float(group["later_s"].median())
    line: dict[str, Any] = {name: group[name].iloc[0] for name in (*CELL, "n", "searched")}
    line |= {"cases": len(group), "within": int((group["verdict"] == "within").sum())}
    line |= {"case_s": case_s, "rate": 1 / case_s if case_s > 0 else None}
    line |= {
        "first_s": answered.loc[first, "case_s"].median(),
        "once_s": float(group[["convert_s", "prepare_s"]].max().sum()),
        "first_iterations": answered.loc[first, "iterations"].median(),
        "later_iterations": answered.loc[later, "iterations"].median(),
        "batched": group["batched"].max(),
        "error_mm": answered["displacement_error_mm"].max(),
    }
    line |= {"to_library": group["to_library"].median(), "to_library_least": group["to_library"].min()}
    return line | {"to_library_most": group["to_library"].max()}
