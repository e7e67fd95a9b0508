"""How much repeated times vary, which times are unreliable, and why."""

from __future__ import annotations

from typing import Any

import pandas as pd

from harness.results.schema import ANSWERED
from report.document.blocks import Block, Place, Section, Table, Text, number, word
from report.document.numbers import counted, whole
from report.results.labels import named
from report.results.reader import Results
from report.results.rows import CELL

PLACE = Place(390)

SPREAD = 0.2  # (largest − least) / median: a time that varies by more is called unstable
SHORT = 0.05  # seconds: shorter times are dominated by the clock and the start of threads


def section(results: Results) -> Section | None:
    table = spreads(results)
    repeated = table[table["repeats"] > 1]
    if repeated.empty:
        return None
    unstable = repeated[repeated["spread"] > SPREAD].sort_values("spread", ascending=False)
    once = len(table) - len(repeated)
    words = (
        f"Of {counted(len(repeated), 'time')} measured repeatedly, {len(unstable)} vary by more than "
        f"{SPREAD:.0%} of the median; half of them by at most {repeated['spread'].median():.1%}."
    )
    if once:
        were = "was" if once == 1 else "were"
        words += f" The other {counted(once, 'time')} {were} measured once; assume that they vary as much."
    blocks: list[Block] = [Text(words)]
    if len(unstable):
        blocks.append(_table(unstable))
    return Section("Repeatability of the times", blocks)


def spreads(results: Results) -> pd.DataFrame:
    """One line per cell with answers: of its repeats' seconds per load case the median, least and largest,
    `spread` = (largest − least) / median, and `why` they may vary.
    """
    rows = named(results.rows[results.rows["case"].isna()])  # the cases of a series are no repeats
    rows = rows[rows["verdict"].isin(ANSWERED) & rows["solve_s"].notna()]
    rows = rows.assign(seconds=rows[["setup_s", "solve_s", "form_s"]].sum(axis=1))
    lines = [_line(runs) for _, runs in rows.groupby(CELL, dropna=False, sort=False)]
    return pd.DataFrame(lines, columns=[*lines[0]] if lines else ["repeats", "spread"])


def _line(runs: pd.DataFrame) -> dict[str, Any]:
    seconds = runs["seconds"]
    line: dict[str, Any] = {"label": runs["label"].iloc[0], "scene": runs["scene"].iloc[0]}
    line |= {"repeats": len(runs), "median_s": seconds.median(), "least_s": seconds.min()}
    line |= {"most_s": seconds.max(), "spread": (seconds.max() - seconds.min()) / seconds.median()}
    return line | {"why": why(runs)}


def why(runs: pd.DataFrame) -> str:
    """What differs between the repeats of one measurement, the likeliest cause first."""
    for name, words in (("iterations", "iterations"), ("inner_iterations", "inner iterations")):
        least, most = runs[name].min(), runs[name].max()
        if most > least:
            return f"{whole(least)} to {whole(most)} {words}: the solver is not deterministic"
    if runs["seconds"].median() < SHORT:
        return f"shorter than {SHORT:g} s: dominated by the start of threads and the clock"
    slowest = runs.sort_values("seconds")["recorded_at"].iloc[-1]
    return f"the same iterations each time, so the machine; slowest at {slowest}"


def _table(unstable: pd.DataFrame) -> Table:
    columns = [
        word("solver (form)", "label"),
        word("scene", "scene"),
        number("repeats", "repeats", whole),
        number("median, s", "median_s"),
        number("least, s", "least_s"),
        number("largest, s", "most_s"),
        number("spread, %", "percent", whole),
        word("why", "why"),
    ]
    caption = "*Unreliable times*, the most variable first. Spread: (largest − least) / median."
    return Table("unstable-times", caption, unstable.assign(percent=100 * unstable["spread"]), columns)
