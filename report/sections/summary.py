"""Which solver to use, and the standing of every solver."""

import math
from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.figure import Figure as Drawing

from report.analysis.standings import (
    ACCURACIES,
    SHIFT_S,
    best_tolerances,
    cells_of_curves,
    recommended,
    shown,
    standings,
)
from report.analysis.time_to_solution import stage_seconds
from report.document.blocks import Block, Column, Figure, Section, Table, number, records, word
from report.document.numbers import MISSING, listed, power, significant, tidy_power, whole
from report.figures.line_charts import Cell, Group, grid
from report.results.reader import Results

EACH, PREPARED, FROM_SCENE = "each load case", "one, with preparation", "one, from the scene on"
ROW = 0.26  # inches
WIDEST = 19.0  # columns
SLOWEST = 100.0  # times as long as the fastest of a scene: the pale end of the shading
SHORT = {"memory_limit": "memory", "iteration_limit": "iterations", "unsupported": "n/a"}


def advice(results: Results) -> Section | None:
    """The fastest line within the limit on every scene of a size, by three ways of counting seconds and,
    after a sweep over tolerances, for other accuracies.
    """
    cells = results.cells[results.cells["status"] != "unsupported"]
    if not cells.groupby("n")["method"].nunique().max() >= 2:
        return None
    cells_by_stage = stage_seconds(results)
    counted = [
        (EACH, cells, "load_case_s"),
        (PREPARED, cells, "total_s"),
        (FROM_SCENE, cells_by_stage, "total_1_s"),
    ]
    lines, sweep = [], cells_of_curves(results)
    for n in sorted(cells["n"].dropna().unique()):
        limit = cells.loc[cells["n"] == n, "limit_mm"].max()
        for what, among, seconds in counted:
            if len(of_size := among[among["n"] == n]):
                line = recommended(of_size, None, seconds)
                lines.append(line | {"accuracy_mm": limit, "seconds of": what})
        of_size = sweep[sweep["n"] == n]
        for accuracy_mm in ACCURACIES if len(of_size) else ():
            if accuracy_mm != limit:
                lines.append(recommended(of_size, accuracy_mm) | {"seconds of": EACH})
    columns = [
        number("n", "n", whole),
        number("error ≤, mm", "accuracy_mm", tidy_power),
        word("seconds of", "seconds of"),
        word("use", "use"),
        number("s", "seconds"),
        Column("next (times as long)", lambda line: _other(line, "next"), "left"),
        Column("fastest textbook method", lambda line: _other(line, "textbook"), "left"),
        Column("fastest library", lambda line: _other(line, "library"), "left"),
    ]
    caption = (
        "*The fastest solver whose error is small enough on every scene of that size*, by the geometric "
        "mean of its seconds over the scenes."
    )
    return Section("Which solver to use", [Table("advice", caption, pd.DataFrame(lines), columns)])


def _other(line: Mapping[str, Any], name: str) -> str:
    times = line[f"to_{name}"]
    if times is None or times != times:
        return MISSING
    return "the same" if line[name] == line["use"] else f"{line[name]} ({significant(times, 2)} ×)"


def summary(results: Results) -> Section | None:
    table = standings(results.cells)
    if table.empty:
        return None
    limit, drawn = results.limit, shown(best_tolerances(results.cells), ("unsupported",))
    columns = [
        word("solver (form)", "method"),
        Column(f"within {limit}", lambda line: f"{line['within']} of {line['scenes']}"),
        Column("outside", _outside),
        Column("no answer", _no_answer),
    ]
    if table["cannot_be_judged"].any():
        columns.append(number("cannot be judged", "cannot_be_judged", whole))
    columns.append(number("worst error, mm", "worst_error_mm", power))
    sizes = [name for name in table.columns if name.startswith("load_case_s_")]
    columns += [number(name.replace("load_case_s_", "s per load case, n = "), name) for name in sizes]
    columns.append(number("shifted geometric mean, s", "shifted_mean_s"))
    blocks: list[Block] = []
    if len(drawn):
        blocks.append(Figure("summary", explained(drawn, table, limit), scoreboard(drawn, table)))
    caption = (
        "*Answers within the limit, then time*, with the best tolerance on each scene. Seconds are "
        "geometric means of the methods within the limit on every scene of the size. The shifted geometric "
        f"mean, exp(mean log(t + {SHIFT_S:g} s)) − {SHIFT_S:g} s, is of the seconds with preparation on all "
        "scenes; where no answer is within the limit, the largest time limit on the scene counts."
    )
    return Section("Summary", [*blocks, Table("summary", caption, table, columns)])


def _outside(row: Mapping[str, Any]) -> str:
    claimed = row["outside_claimed"]
    return f"{row['outside']} ({claimed} reported solved)" if claimed else str(row["outside"])


def _no_answer(row: Mapping[str, Any]) -> str:
    return f"{row['no_answer']} ({row['no_answer_because']})" if row["no_answer"] else "0"


def explained(cells: pd.DataFrame, standings: pd.DataFrame, limit: str) -> str:
    """The caption of `scoreboard`, with the methods that it lacks."""
    words = (
        "*Every solver on every scene, the best first*, with its number of scenes within the limit; below "
        f"the columns: active contacts. Blue: within {limit}, seconds per load case, the darker, the closer "
        "to the fastest on the scene; hatched: outside, the error in mm; grey: no answer, and why; empty: "
        "not in the plan."
    )
    missing = sorted(set(standings["method"]) - set(cells["method"]))
    return words + (f" Run on fewer than half of the scenes: {listed(missing)}." if missing else "")


def scoreboard(cells: pd.DataFrame, standings: pd.DataFrame) -> Drawing:
    """One row per method in the order of the standings, one column per scene by size and active contacts.

    cells : one per method and scene. Shades of blue: from the fastest of the scene to 100 times as long.
    """
    scenes = cells.drop_duplicates("scene").sort_values(["n", "active", "scene"])
    groups = [
        Group(f"n = {n:.0f}", dict(zip(of_size["scene"], map(whole, of_size["active"]), strict=True)))
        for n, of_size in scenes.groupby("n")
    ]
    lines = standings[standings["method"].isin(cells["method"])]
    rows = {
        line["method"]: f"{line['method']}   {line['within']} of {line['scenes']}" for line in records(lines)
    }
    within = cells["load_case_s"].where(cells["verdict"] == "within")
    cells = cells.assign(slower=within / within.groupby(cells["scene"]).transform("min"))
    found = {(cell["method"], cell["scene"]): _cell(cell) for cell in records(cells)}
    return grid(rows, groups, found, ROW, WIDEST)


def _cell(cell: Mapping[str, Any]) -> Cell:
    match cell["verdict"]:
        case "within":
            slow = min(1.0, math.log(cell["slower"]) / math.log(SLOWEST))
            face = mpl.colors.to_hex(mpl.colormaps["Blues"](0.88 - 0.78 * slow))
            return Cell(significant(cell["load_case_s"], 2), face, "white" if slow < 0.45 else "black")
        case "outside":
            return Cell(power(cell["displacement_error_mm"], 2), "white", "black", "//////")
        case "cannot_be_judged":
            return Cell("?", "#F1F1F1")
    if cell["status"] == "time_limit" and cell["time_limit_s"] > 0:
        return Cell(f"> {cell['time_limit_s']:g} s", "#F1F1F1")
    return Cell(SHORT.get(cell["status"], cell["status"].replace("_", " ")), "#F1F1F1")
