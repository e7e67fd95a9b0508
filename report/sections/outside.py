"""Problems from outside: the optimum beside what its source prints, and its convergence under refinement."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pandas as pd

from report.analysis.seconds import seconds_text
from report.document.blocks import Column, Section, Table, number, records, word
from report.document.numbers import MISSING, power, significant, whole
from report.results.reader import Results

PREFIX = "outside/"
DIGITS = 9  # of an objective as shown


def section(results: Results) -> Section | None:
    """For the scenes outside/…, by the answers within the limit."""
    cells = results.cells[results.cells["scene"].str.startswith(PREFIX)]
    answered = cells[(cells["verdict"] == "within") & cells["objective"].notna()]
    if answered.empty:
        return None
    best = answered.sort_values("displacement_error_mm").drop_duplicates("scene")
    tables = [_printed(best, results.problems), _refined(best)]
    return Section("Problems from outside", [table for table in tables if table])


def _printed(best: pd.DataFrame, problems: pd.DataFrame) -> Table | None:
    if "printed_objective" not in problems:
        return None
    known = problems.dropna(subset=["printed_objective"]).drop_duplicates("scene", keep="last")
    both = best.merge(known[["scene", "printed_objective", "printed_digits", "printed_source"]], on="scene")
    if both.empty:
        return None
    away = (both["objective"] - both["printed_objective"]).abs() / both["printed_objective"].abs()
    lines = both.assign(away=away).sort_values(["printed_source", "n"])
    columns = [
        word("scene", "scene"),
        number("unknowns", "n", whole),
        number("closed", "active", whole),
        Column("objective", lambda line: significant(line["objective"], DIGITS)),
        Column("printed", lambda line: significant(line["printed_objective"], int(line["printed_digits"]))),
        number("relative difference", "away", lambda value: power(value, 1)),
        word("source", "printed_source"),
    ]
    shown = ["scene", "n", "active", "objective", "printed_objective", "away", "printed_source"]
    caption = "*Printed optima*: the source prints so many digits, of an answer to its own tolerance."
    return Table("outside-printed", caption, lines[[*shown, "printed_digits"]], columns)


def _refined(best: pd.DataFrame) -> Table | None:
    parts = best["scene"].str.split("/", expand=True)
    sizes = pd.to_numeric(parts[2], errors="coerce")
    lines: list[dict[str, Any]] = []
    for problem, cells in (
        best.assign(problem=parts[1], cells=sizes).dropna(subset="cells").groupby("problem")
    ):
        lines += _line_of_each(str(problem), records(cells.sort_values("cells")))
    if not lines:
        return None
    columns = [
        word("problem", "problem"),
        number("cells a side", "cells", whole),
        number("unknowns", "n", whole),
        number("closed", "active", whole),
        Column("objective", lambda line: significant(line["objective"], DIGITS)),
        number("change", "change", lambda value: power(value, 2)),
        number("order", "order", lambda value: MISSING if value != value else f"{value:.2f}"),
        Column("seconds", lambda line: line["seconds"]),
    ]
    caption = (
        "*Refinement*: the change of the objective from the grid before; order: p with changes as hᵖ, from "
        "three grids each of half the spacing. Seconds per load case of that answer."
    )
    return Table("outside-refinement", caption, pd.DataFrame(lines), columns)


def _line_of_each(problem: str, cells: list[dict[str, Any]]) -> list[dict[str, Any]]:
    lines: list[dict[str, Any]] = []
    for cell in cells:
        line = {name: cell[name] for name in ("cells", "n", "active", "objective")}
        line |= {"problem": problem, "seconds": seconds_text(cell), "change": math.nan, "order": math.nan}
        if lines:
            line["change"] = line["objective"] - lines[-1]["objective"]
            line["order"] = _order(line, lines[-1], lines[-2] if len(lines) > 1 else None)
        lines.append(line)
    return lines


def _order(fine: Mapping[str, Any], middle: Mapping[str, Any], coarse: Mapping[str, Any] | None) -> float:
    """log₂ of the ratio of two changes of one sign, of grids that are halved each time; else NaN."""
    if coarse is None or fine["cells"] != 2 * middle["cells"] or middle["cells"] != 2 * coarse["cells"]:
        return math.nan
    ratio = middle["change"] / fine["change"] if fine["change"] else math.nan
    return math.log2(ratio) if ratio > 0 else math.nan
