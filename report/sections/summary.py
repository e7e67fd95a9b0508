"""The summary: who is within the limit, how fast, and which solver to use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from report.analysis.advice import advice
from report.analysis.drawn import left_out, sidelined
from report.analysis.precision import ENOUGH
from report.analysis.standings import TIE, compare, standings
from report.document.blocks import Block, Column, Figure, Place, Section, Table, Text, number, word
from report.document.numbers import counted, listed, power, whole
from report.figures.scoreboard import scoreboard
from report.results.reader import Results

PLACE = Place(110)


def section(results: Results) -> Section | None:
    table = standings(results)
    if table.empty:
        return None
    several = table.groupby("method")["label"].transform("size") >= ENOUGH
    table = table[~(several & table["method"].duplicated())]
    limit = results.limit
    rare = sidelined(results)["label"]
    comparisons = [compare(results, n) for n in results.sizes]
    columns = [
        word("solver (form)", "label"),
        Column(f"within {limit}", lambda row: f"{row['within']} of {row['scenes']}"),
        Column("outside", _outside),
        Column("no answer", _no_answer),
    ]
    if table["cannot_be_judged"].any():
        columns.append(number("cannot be judged", "cannot_be_judged", whole))
    columns.append(number("worst error, mm", "worst_error_mm", power))
    columns += [number(f"s a load case, n = {n}", f"load_case_s_{n}") for n in results.sizes]
    columns.append(number("peak memory, MiB", "peak_rss_mib", whole))

    compared = [
        f"n = {c.n}: {len(c.common)} of {counted(len(c.scenes), 'scene')}" for c in comparisons if c.seconds
    ]
    means = (
        "Seconds a load case (set-up + solve + the dual form's own cost) are geometric means over the scenes "
        "that every compared line answered within the limit "
        f"({'; '.join(compared) or 'there is none'}); compared are the lines "
        "within the limit on more than half of a size's scenes, the others show –. What failed is counted, "
        "never averaged in."
    )
    if several.any():
        means += f" Of {ENOUGH} tolerances or more of a solver, the best; the tables of the scenes have all."
    blocks: list[Block] = [
        Text("### Which solver to use"),
        Text("\n".join(words for n in results.sizes if (words := advice(results, n)))),
        Text(_small_print(results)),
        Figure(
            "summary",
            f"*Every solver on every scene, the best at the top.* Blue: within {limit}, seconds a load case; "
            "the darker, the nearer to the fastest of the scene (palest: 100 times as long). Hatched: "
            "outside the limit, with its error in mm. Grey: no answer, and why (not run: out of time "
            "already at a looser tolerance, or on every scene of the next smaller size). Empty: not asked "
            "for. At the right, the number of scenes within the limit." + left_out(results),
            scoreboard(results.cells, table[~table["label"].isin(rare)]),
        ),
        Text("### Answers within the limit, then time"),
        Table("summary", means, table, columns),
    ]
    return Section("Summary", blocks)


def _outside(row: Mapping[str, Any]) -> str:
    said = row["outside_said_solved"]
    return f"{row['outside']} ({said} said solved)" if said else str(row["outside"])


def _no_answer(row: Mapping[str, Any]) -> str:
    return f"{row['no_answer']} ({row['no_answer_because']})" if row["no_answer"] else "0"


def _small_print(results: Results) -> str:
    repeats = int(results.cells["repeats"].max())
    runs = "Each time is one run" if repeats == 1 else f"Times are medians of up to {repeats} runs"
    unsupported = sorted(results.cells.loc[results.cells["status"] == "unsupported", "label"].unique())
    left_out = f" Not offered by the solver and not counted: {listed(unsupported)}." if unsupported else ""
    return f"{runs}; lines less than {TIE - 1:.0%} apart are called equally fast.{left_out}"
