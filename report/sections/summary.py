"""The summary: which solvers are within the limit, how fast they are, and which one to use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from report.analysis.advice import advice
from report.analysis.drawn import omission_note, rare_variants
from report.analysis.precision import CURVE_POINTS
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
    several = table.groupby("method")["label"].transform("size") >= CURVE_POINTS
    table = table[~(several & table["method"].duplicated())]
    limit = results.limit
    rare = rare_variants(results)["label"]
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
    columns += [number(f"s per load case, n = {n}", f"load_case_s_{n}") for n in results.sizes]

    compared = [
        f"n = {c.n}: {len(c.common)} of {counted(len(c.scenes), 'scene')}" for c in comparisons if c.seconds
    ]
    means = (
        "Seconds per load case (set-up + solve + form) are geometric means over the scenes that every "
        "compared line answered within the limit "
        f"({'; '.join(compared) or 'there is none'}). Compared are the lines within the limit on more than "
        "half of the scenes of a size; the others show –. Failures are counted, but enter no mean."
    )
    if several.any():
        means += f" Of {CURVE_POINTS} or more tolerances of a solver, the best; the tables by scene have all."
    blocks: list[Block] = [
        Text("### The fastest of these solvers"),
        Text(advice(results)),
        Text(_small_print(results)),
        Figure(
            "summary",
            f"*Every solver on every scene, the best first.* Blue: within {limit}, seconds per load case; "
            "the darker, the closer to the fastest on the scene (palest: 100 times as long). Hatched: "
            "outside the limit, with the error in mm. Grey: no answer, and why (not run: predicted to exceed "
            "the time limit, from a looser tolerance or from every scene of the next smaller size). Empty: "
            "not in the plan. On the right, the number of scenes within the limit." + omission_note(results),
            scoreboard(results.cells, table[~table["label"].isin(rare)]),
        ),
        Text("### Answers within the limit, then time"),
        Table("summary", means, table, columns),
    ]
    return Section("Summary", blocks)


def _outside(row: Mapping[str, Any]) -> str:
    claimed = row["outside_claimed"]
    return f"{row['outside']} ({claimed} reported solved)" if claimed else str(row["outside"])


def _no_answer(row: Mapping[str, Any]) -> str:
    return f"{row['no_answer']} ({row['no_answer_because']})" if row["no_answer"] else "0"


def _small_print(results: Results) -> str:
    repeats = int(results.cells["repeats"].max())
    runs = "Each time is one run" if repeats == 1 else f"Times are medians of up to {repeats} runs"
    unsupported = sorted(results.cells.loc[results.cells["status"] == "unsupported", "label"].unique())
    omitted = f" Form not taken by the solver: {listed(unsupported)}." if unsupported else ""
    apart = f"less than {TIE - 1:.0%} apart, or than their own repeats differ by,"
    return f"{runs}; lines {apart} count as equally fast.{omitted}"
