"""Series: load cases a second and their errors, solver by solver."""

from __future__ import annotations

import pandas as pd

from ..blocks import Column, Section, Table, number, word
from ..labels import named
from ..numbers import power, whole
from ..rows import ANSWERED, CELL, Results

CASE = ["setup_s", "solve_s", "form_s"]


def section(results: Results) -> Section | None:
    rows = results.rows[results.rows["case"].notna()]
    if rows.empty:
        return None
    lines = pd.DataFrame([_line(group) for _, group in rows.groupby(CELL, dropna=False, sort=False)])
    lines = named(lines).sort_values(["n", "scene", "rate"], ascending=[True, True, False])
    columns = [
        word("scene", "scene"),
        word("solver", "label"),
        Column("within", lambda row: f"{row['within']} of {row['cases']}"),
        number("cases/s", "rate"),
        number("first case, s", "first_s"),
        number("a later one, s", "later_s"),
        number("once, s", "once_s"),
        number("iterations, first", "first_iterations", whole),
        number("later", "later_iterations", whole),
        number("largest error, mm", "error_mm", power),
    ]
    caption = (
        "*Series: load cases on one assembly, one after another in one process.* *Cases/s* and *a later one* "
        "are of the cases after the first, which the solver takes in its own repeated-solve mode: their "
        "median time for update, solve and the dual form's p and x. *Once*: convert and prepare."
    )
    return Section("Series of load cases", [Table("series", caption, lines, columns)])


def _line(group: pd.DataFrame) -> dict[str, object]:
    group = group.sort_values("case")
    answered = group[group["verdict"].isin(ANSWERED)]
    seconds = answered[CASE].sum(axis=1)
    later = answered["case"] > group["case"].min()
    later_s = float(seconds[later].median())
    first = group.iloc[0]
    return {
        **{name: first[name] for name in (*CELL, "n")},
        "cases": len(group),
        "within": int((group["verdict"] == "within").sum()),
        "rate": 1 / later_s if later_s > 0 else None,
        "first_s": float(seconds[~later].median()),
        "later_s": later_s,
        "once_s": float(first[["convert_s", "prepare_s"]].sum()),
        "first_iterations": answered.loc[~later, "iterations"].median(),
        "later_iterations": answered.loc[later, "iterations"].median(),
        "error_mm": answered["displacement_error_mm"].max(),
    }
