"""The versions of each library over time, on the scenes that all of them were measured on.

Seconds per load case of its best form, and these as multiples of the fastest textbook method of the same
round: that method stays, so that neither another machine nor a faster solver of ours shows as a change.
"""

from __future__ import annotations

from typing import Any

import pandas as pd
from matplotlib.figure import Figure as Drawing

from report.document.blocks import Figure, Section, Table, number, word
from report.document.numbers import whole
from report.figures import style
from report.results.reader import Results
from report.results.rows import CELL, VERSION, cells_of

MINUTE = 16  # characters of a time: states of a plug-in follow one another within a day
POINT = ["solver", *VERSION]
PROBLEM = ["scene", "scene_key"]  # the key, as a file may have changed under its name
CAPTION = (
    "*Libraries over versions and dates*, on the scenes that all versions have: the best form's seconds per "
    "load case, and as multiples of the fastest textbook method measured beside it; medians of the answers "
    "within the limit."
)


def section(results: Results) -> Section | None:
    """For results with rows of an older version or adapter beside the present one's."""
    present = results.rows[results.rows["owner"] == "library"]
    older = results.outdated[results.outdated["solver"].isin(present["solver"])]
    older = older.merge(present[PROBLEM].drop_duplicates())
    if older.empty or not (results.rounds["owner"] == "textbook").any():
        return None
    rows = pd.concat([older, present]).drop_duplicates([*CELL, *VERSION, "repeat", "case"], keep="last")
    lines = _lines(cells_of(rows.reset_index(drop=True), [*CELL, *VERSION]), results.rounds)
    if lines.empty:
        return None
    columns = [word("library", "solver"), word("version", "solver_version"), word("measured", "measured")]
    columns += [number("scenes", "scenes", whole), number("within", "within", whole)]
    columns += [number("s", "seconds"), number("× textbook", "times")]
    figure = Figure("history", "*Multiples of the fastest textbook method's time*, by date.", _drawing(lines))
    return Section("Libraries over time", [Table("history", CAPTION, lines, columns), figure])


def _lines(cells: pd.DataFrame, rounds: pd.DataFrame) -> pd.DataFrame:
    """A line per version of each library that has several, on the scenes of all; the oldest first."""
    textbook = cells_of(rounds[(rounds["owner"] == "textbook") & (rounds["verdict"] == "within")])
    least = textbook.groupby(["machine", "scene", "round"])["load_case_s"].min().rename("least")
    cells = cells.join(least, on=["machine", "scene", "beside_round"])
    seconds = cells["load_case_s"].where(cells["verdict"] == "within")
    cells = cells.assign(seconds=seconds, times=seconds / cells["least"])
    best = cells.groupby([*POINT, *PROBLEM]).agg({"seconds": "min", "times": "min", "recorded_at": "max"})
    lines: list[dict[str, Any]] = []
    for _, of_solver in best.reset_index().groupby("solver"):
        versions = of_solver.groupby(POINT).ngroups
        common = of_solver[of_solver.groupby(PROBLEM)["scene"].transform("size") == versions]
        for (solver, version, _), rows in common.groupby(POINT) if versions > 1 else ():
            line = {
                "solver": solver,
                "solver_version": version,
                "measured": rows["recorded_at"].max()[:MINUTE],
            }
            line |= {"scenes": len(rows), "within": rows["seconds"].count()}
            lines.append(line | {"seconds": rows["seconds"].median(), "times": rows["times"].median()})
    return pd.DataFrame(lines).sort_values(["solver", "measured"]) if lines else pd.DataFrame()


def _drawing(lines: pd.DataFrame) -> Drawing:
    pairs = style.looks(lines["solver"])
    styles: dict[str, Any] = {
        name: dict(zip(("color", "marker"), pairs[name], strict=True)) for name in lines["solver"]
    }
    drawing = style.figure_above(3.0, style.legend_entries(styles))
    axes = drawing.subplots()
    for solver, rows in lines.groupby("solver"):
        axes.plot(pd.to_datetime(rows["measured"]), rows["times"], **styles[str(solver)])
    axes.set(yscale="log", ylabel="× textbook")
    style.plain_log(axes.yaxis)
    return drawing
