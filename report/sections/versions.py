"""Versions of a library side by side."""

from __future__ import annotations

import pandas as pd

from report.analysis.comparison import WORSE
from report.analysis.seconds import seconds_text
from report.analysis.versions import of_versions
from report.document.blocks import Block, Column, Section, Table, Text, number, records, word
from report.document.escape import QUOTED, file_name, short
from report.document.numbers import counted, power, whole
from report.results.reader import Results

MEANING = (
    "Worse than the version above: a verdict lost, an error more than ten times as large, or more than 10 % "
    "more seconds per load case, beyond their spread; fewer than three repeats are taken to vary by 15 %. A "
    "version that failed could not be installed, or has another interface than its adapter calls."
)
LONGEST = 300  # characters of a reason


def section(results: Results) -> Section | None:
    """For results with several versions of one solver on one scene: a table per solver."""
    blocks: list[Block] = []
    for solver, cells in of_versions(results).items():
        blocks += _blocks(solver, cells)
    return Section("Versions", [Text(MEANING), *blocks]) if blocks else None


def _blocks(solver: str, cells: pd.DataFrame) -> list[Block]:
    worse, compared = cells["group"] == WORSE, int(cells["group"].notna().sum())
    lost = cells["verdict"] == "no_answer"
    cells = cells.assign(
        verdict=cells["verdict"].str.replace("_", " "),
        against=worse.map({True: "worse: ", False: ""}) + cells["change"].fillna(""),
        seconds=[seconds_text(cell) for cell in records(cells)],
    )
    columns = [
        word("scene", "scene"),
        word("form", "what"),
        word("version", "solver_version"),
        Column("s", lambda line: str(line["seconds"])),
        number("iterations", "iterations", whole),
        number("error, mm", "displacement_error_mm", lambda error: power(error, 2)),
        word("verdict", "verdict"),
        word("against the version above", "against"),
    ]
    count = f"{worse.sum()} of {counted(compared, 'measurement')} became worse"
    count += f", {counted(int(lost.sum()), 'measurement')} without an answer" if lost.any() else ""
    blocks: list[Block] = [Table(f"versions-{file_name(solver)}", f"*{solver}*: {count}.", cells, columns)]
    failed = records(cells[cells["status"].isin(["failed", "crashed"]) & (cells["message"] != "")])
    first = [short(cell["message"].partition(QUOTED["\n"])[0], LONGEST) for cell in failed]
    reasons = [
        f"- {solver} {cell['solver_version']}: {line}" for cell, line in zip(failed, first, strict=True)
    ]
    return [*blocks, Text("\n".join(dict.fromkeys(reasons)))] if reasons else blocks
