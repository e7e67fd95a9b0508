"""Problems from outside: the optimum beside what its source prints, and its convergence under refinement."""

import numpy as np
import pandas as pd

from report.analysis.standings import seconds_text
from report.document.blocks import Column, Section, Table, number, records, word
from report.document.numbers import MISSING, power, significant, whole
from report.results.reader import Results
from report.results.rows import rung_of

PREFIX = "outside/"
DIGITS = 9  # of an objective as shown


def section(results: Results) -> Section | None:
    """For the scenes outside/…, by the answers within the limit."""
    cells = results.cells[results.cells["scene"].str.startswith(PREFIX)]
    answered = cells[(cells["verdict"] == "within") & cells["objective"].notna()]
    if answered.empty:
        return None
    best = answered.sort_values("displacement_error_mm").drop_duplicates("scene")
    tables = [table for table in (_printed(best, results.problems), _refined(best)) if table]
    return Section("Problems from outside", [*tables]) if tables else None


def _printed(best: pd.DataFrame, problems: pd.DataFrame) -> Table | None:
    if "printed_objective" not in problems:
        return None
    printed = ["printed_objective", "printed_digits", "printed_source"]
    known = problems.reindex(columns=["scene", *printed]).dropna(subset=printed)
    both = best.merge(known.drop_duplicates("scene", keep="last"), on="scene")
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
    problems, sizes = zip(*map(rung_of, best["scene"]), strict=True)
    cells = pd.to_numeric(pd.Series(sizes, best.index), errors="coerce")
    lines = best.assign(problem=problems, cells=cells)
    lines = lines.dropna(subset="cells").sort_values(["problem", "cells"], ignore_index=True)
    if lines.empty:
        return None
    before = lines.groupby("problem")[["cells", "objective"]].shift()
    change, halved = lines["objective"] - before["objective"], lines["cells"] == 2 * before["cells"]
    ratio = change.shift() / change.where(change != 0)
    comparable = halved & halved.shift(fill_value=False) & (ratio > 0)
    lines = lines[["problem", "cells", "n", "active", "objective"]].assign(
        change=change,
        order=np.log2(ratio.where(comparable)),
        seconds=[seconds_text(cell) for cell in records(lines)],
    )
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
    return Table("outside-refinement", caption, lines, columns)
