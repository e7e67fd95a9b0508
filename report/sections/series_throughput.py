"""Series: load cases per second and their errors by solver, also relative to the fastest library."""

import pandas as pd

from harness.results.schema import ANSWERED
from report.analysis.standings import ROUND, of_fastest, spreads
from report.document.blocks import Column, Section, Table, number, word
from report.document.numbers import power, spread, whole
from report.results.reader import Results
from report.results.rows import CELL, named

CASE = ["setup_s", "solve_s", "form_s"]


def section(results: Results) -> Section | None:
    rows = results.rows[results.rows["case"].notna()]
    if rows.empty:
        return None
    rows = compared(rows)
    answered = rows["verdict"].isin(ANSWERED)
    rows = rows.assign(
        within=rows["verdict"] == "within",
        error_mm=rows["displacement_error_mm"].where(answered),
        first_s=rows["case_s"].where(answered & (rows["warm"] == 0)),
    )
    groups = rows.groupby(CELL, dropna=False)
    lines = groups[["n", "searched", "owner"]].first().assign(cases=groups.size())
    lines["within"] = groups["within"].sum()
    lines["case_s"] = groups["later_s"].median()
    lines["once_s"] = groups[["convert_s", "prepare_s"]].max().sum(axis=1, min_count=1)
    lines["first_s"] = groups["first_s"].median()
    lines[["batched", "error_mm"]] = groups[["batched", "error_mm"]].max()
    lines = lines.join(spreads(rows, CELL, ["to_library"])).reset_index()
    lines = pd.concat([named(group) for _, group in lines.groupby(ROUND, dropna=False)])
    lines = lines.sort_values(["n", "scene", "threads_asked", "case_s"])
    columns = [
        word("scene", "scene"),
        number("threads", "threads_asked", whole),
        word("solver (form)", "label"),
        Column("within", lambda row: f"{row['within']} of {row['cases']}"),
        number("s per case", "case_s"),
        number("per assembly, s", "once_s"),
        number("largest error, mm", "error_mm", power),
        Column("time relative to the fastest library", spread("to_library")),
    ]
    caption = (
        "*Load cases on one assembly, in one process*: the median over the cases after the first (of "
        "batches: after the first batch); relative to the fastest library within the limit on all of them, "
        "by its update or from the start, the median (range)."
    )
    return Section("Series of load cases", [Table("series", caption, lines, columns, keys=3)])


def compared(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of series with `case_s`, the seconds per case; `later_s`, the same if a case was solved before and
    the answer is within the limit; `library_s`, the seconds of the fastest library, which may take each case
    as its first; `to_library`, later_s relative to them.
    """
    rows = rows.assign(case_s=rows[CASE].sum(axis=1))
    within = rows["case_s"].where(rows["verdict"] == "within")
    rows = rows.assign(later_s=within.where(rows["warm"] == 1), cold_s=within.where(rows["warm"] == 0))
    library = of_fastest("library", rows, "later_s", "cold_s")
    return rows.assign(library_s=library, to_library=rows["later_s"] / library)
