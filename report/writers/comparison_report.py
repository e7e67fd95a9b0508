"""Writes what changed between runs: comparison.md, comparison.csv with every measurement, and index.html."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from report.analysis.checks import commits_text
from report.analysis.comparison import BETTER, CHANGED, GROUPS, WORSE, by_solver
from report.document.blocks import Block, Column, Section, Table, Text, number, word
from report.document.escape import file_name
from report.document.numbers import MISSING, as_number, counted, listed, power, significant, whole
from report.page.page_file import Data, banner, table_data
from report.page.page_file import write as write_page
from report.writers.sections_writer import emptied, written

NOTE = (
    "Digits are those of the displacement error, + gained and − lost, above the reference's error bound. A "
    "ratio of times is that of seconds per load case, new over old, with its interval from the repeats; "
    "fewer than three are taken to vary by 15 %, or as the ratios of the other measurements do. An answer "
    "outside the limit has none."
)
SIDES = ("old", "new")


@dataclass(frozen=True)
class Comparison:
    """One run against an older one. untimed : why times are not compared, a sentence, or ""; rows : of both,
    with their `side`.
    """

    old: str
    new: str
    table: pd.DataFrame
    untimed: str
    rows: pd.DataFrame

    @property
    def worse(self) -> bool:
        return bool((self.table["group"] == WORSE).any())

    @property
    def summary(self) -> str:
        """'238 measurements: 3 worse, 5 better, 1 another status, 229 alike.'"""
        sizes = self.table["group"].value_counts()
        counts = [f"{sizes[group]} {group}" for group in dict.fromkeys(GROUPS) if group in sizes]
        return f"{counted(len(self.table), 'measurement')}: {', '.join(counts)}. {self.untimed}".strip()


def arrow(heading: str, name: str, show: Callable[[Any], str] = significant, align: str = "right") -> Column:
    """A column of '1.2e-11 → 9.0e-8', or one figure if both sides are the same."""
    return Column(
        heading, lambda line: " → ".join(dict.fromkeys(show(line[f"{name}_{side}"]) for side in SIDES)), align
    )


def ratio_text(line: Mapping[str, Any]) -> str:
    """'1.62 (1.40 to 1.85)'."""
    if as_number(line["ratio"]) is None:
        return MISSING
    return f"{line['ratio']:.2f} ({line['ratio_least']:.2f} to {line['ratio_most']:.2f})"


def digits_text(line: Mapping[str, Any]) -> str:
    """'+3.9' digits gained, '−2.0' lost."""
    lost = as_number(line["digits_lost"])
    return MISSING if lost is None else f"{0.0 - round(lost, 1):+.1f}"


COLUMNS = [
    word("measurement", "measurement"),
    word("change", "change"),
    arrow("error, mm", "error_mm", partial(power, digits=2)),
    Column("digits", digits_text),
    arrow("iterations", "iterations", whole),
    arrow("seconds", "seconds"),
    Column("ratio of times", ratio_text),
    arrow("status", "status", str, "left"),
]
SOLVERS = [
    word("solver", "solver"),
    *(number(name, name, whole) for name in ("measurements", "worse", "better")),
    number("digits lost, median", "digits_lost"),
    number("most", "most_digits_lost"),
    number("ratio of times, geometric mean", "ratio"),
]


def write(out: Path, comparisons: list[Comparison]) -> Path:
    """Write the comparisons with one older run into the folder `out`, and return the path of the page."""
    emptied(out, "comparison.md")
    sections = [Section("How to read this", [Text(NOTE)])]
    for place, pair in enumerate(comparisons, start=1):
        blocks = _blocks(pair, f"{place}-" if len(comparisons) > 1 else "")
        sections.append(Section(f"{pair.old} → {pair.new}", blocks))
    lines = pd.concat([pair.table.assign(old=pair.old, new=pair.new) for pair in comparisons])
    title = f"Compared with {comparisons[0].old}"
    new = [pair.rows[pair.rows["side"] == pair.new] for pair in comparisons]
    data: Data = {
        "banner": _banner(pd.concat([comparisons[0].rows, *new[1:]])),
        "tables": [
            table_data(f"{pair.old} → {pair.new}", COLUMNS, pair.table, pair.summary) for pair in comparisons
        ],
    }
    write_page(out / "index.html", title, data)
    return written(out / "comparison.md", title, sections, files={"comparison": lines})


def _blocks(pair: Comparison, prefix: str) -> list[Block]:
    blocks: list[Block] = [Text(f"{pair.summary} Every measurement: [comparison.csv](comparison.csv).")]
    for group in (WORSE, CHANGED, BETTER):
        if len(lines := pair.table[pair.table["group"] == group]):
            blocks.append(Table(f"{prefix}{file_name(group)}", f"*{group.capitalize()}.*", lines, COLUMNS))
    if len(solvers := by_solver(pair.table)):
        blocks.append(Table(f"{prefix}solvers", "*Solver by solver.*", solvers, SOLVERS))
    return blocks


def _banner(rows: pd.DataFrame) -> Data:
    sides = [(str(side), of_side) for side, of_side in rows.groupby("side", sort=False)]
    changed = [side for side, of_side in sides if (of_side["clean"] == 0).any()]
    warned = [f"Rows of {listed(changed)} were measured with uncommitted changes."] if changed else []
    if rows["machine"].nunique() > 1:
        warned.append("The rows come from several machines; times are compared within one machine only.")
    code = "; ".join(f"{side}: {commits_text(of_side)}" for side, of_side in sides)
    return banner(rows, counted(len(rows), "row"), warned) | {"commits": code}
