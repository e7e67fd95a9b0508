"""Which solver to use, and the standing of every solver."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from report.analysis.precision import ACCURACIES, swept
from report.analysis.roads import roads
from report.analysis.standings import best_tolerances, recommended, shown, standings
from report.document.blocks import Block, Column, Figure, Section, Table, number, word
from report.document.numbers import MISSING, power, significant, tidy_power, whole
from report.figures.scoreboard import explained, scoreboard
from report.results.reader import Results

EACH, PREPARED, FROM_SCENE = "each load case", "one, with preparation", "one, from the scene on"


def advice(results: Results) -> Section | None:
    """The fastest line within the limit on every scene of a size, by three ways of counting seconds and,
    after a sweep over tolerances, for other accuracies.
    """
    cells = results.cells[results.cells["status"] != "unsupported"]
    if not cells.groupby("n")["method"].nunique().max() >= 2:
        return None
    ways = roads(results)
    counted = [(EACH, cells, "load_case_s"), (PREPARED, cells, "total_s"), (FROM_SCENE, ways, "total_1_s")]
    lines, sweep = [], swept(results)
    for n in results.sizes:
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
    limit, drawn = results.limit, shown(best_tolerances(results.cells))
    columns = [
        word("solver (form)", "method"),
        Column(f"within {limit}", lambda line: f"{line['within']} of {line['scenes']}"),
        Column("outside", _outside),
        Column("no answer", _no_answer),
    ]
    if table["cannot_be_judged"].any():
        columns.append(number("cannot be judged", "cannot_be_judged", whole))
    columns.append(number("worst error, mm", "worst_error_mm", power))
    columns += [number(f"s per load case, n = {n}", f"load_case_s_{n}") for n in results.sizes]
    blocks: list[Block] = []
    if len(drawn):
        blocks.append(Figure("summary", explained(drawn, table, limit), scoreboard(drawn, table)))
    caption = (
        "*Answers within the limit, then time*, with the best tolerance on each scene. Seconds are "
        "geometric means of the methods within the limit on every scene of the size."
    )
    return Section("Summary", [*blocks, Table("summary", caption, table, columns)])


def _outside(row: Mapping[str, Any]) -> str:
    claimed = row["outside_claimed"]
    return f"{row['outside']} ({claimed} reported solved)" if claimed else str(row["outside"])


def _no_answer(row: Mapping[str, Any]) -> str:
    return f"{row['no_answer']} ({row['no_answer_because']})" if row["no_answer"] else "0"
