"""Writes the report of a results directory: Markdown, a PNG a figure, a CSV a table.

To add a section: write one file in `sections` with a function `section(results)` that returns a
`Section`, or None when the rows have nothing for it, and name it in `SECTIONS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import jinja2

from report.analysis.checks import warnings
from report.document.blocks import Block, Figure, Section, Table
from report.figures import style
from report.results.reader import Results, read
from report.sections import (
    accuracy,
    amortised,
    asked_achieved,
    breakdown,
    details,
    gap_map,
    ingredients,
    ladders,
    machine,
    price_list,
    problems,
    profiles,
    recommendation,
    residual_error,
    rungs,
    same_method,
    scaling,
    series,
    speed,
    stability,
    summary,
    times,
)
from report.sections.paper import claims, figures3_4, figures5_7, table1, table2, table3, table4

SECTIONS: list[Callable[[Results], Section | None]] = [
    summary.section,
    recommendation.section,
    speed.section,
    same_method.section,
    ingredients.section,
    scaling.section,
    series.section,
    claims.section,
    table1.section,
    table2.section,
    table3.section,
    table4.section,
    figures3_4.section,
    figures5_7.section,
    problems.section,
    times.section,
    accuracy.section,
    price_list.section,
    asked_achieved.section,
    residual_error.section,
    profiles.section,
    amortised.section,
    stability.section,
    breakdown.section,
    gap_map.section,
    details.section,
]
#: The same for the rungs of ladders, which the sections above leave out.
OF_RUNGS: list[Callable[[Results], Section | None]] = [ladders.section, rungs.section]


def write(directory: Path) -> Path:
    """Write DIRECTORY/report/report.md anew from the results in DIRECTORY and return its path.

    Raises FileNotFoundError where DIRECTORY has no measurements.jsonl.
    """
    results = read(directory)
    target = directory / "report"
    target.mkdir(exist_ok=True)
    for stale in [*target.glob("*.png"), *target.glob("*.csv")]:
        stale.unlink()
    parts = []
    with style.applied():
        for i, part in enumerate(results.by_machine()):
            made = [section(part.of_rungs(True)) for section in OF_RUNGS]
            made += [section(part.of_rungs(False)) for section in SECTIONS] + [machine.section(part)]
            sections = [section for section in made if section]
            parts.append((part, [_save(section, target, i) for section in sections]))
    path = target / "report.md"
    path.write_text(
        template("report.md.j2").render(results=results, parts=parts, warnings=warnings(results)), "utf-8"
    )
    return path


def template(name: str) -> jinja2.Template:
    """A template of report/templates."""
    loader = jinja2.FileSystemLoader(Path(__file__).parent / "templates")
    environment = jinja2.Environment(
        loader=loader, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    return environment.get_template(name)


def _save(section: Section, target: Path, machine: int) -> Section:
    """Write the section's files; those of a second machine on take its number into their names."""
    prefix = f"machine{machine + 1}-" if machine else ""
    return replace(section, blocks=[save_block(block, target, prefix) for block in section.blocks])


def save_block(block: Block, target: Path, prefix: str = "") -> Block:
    """Write a table's CSV or a figure's PNG; returns the block under the name that it was given."""
    match block:
        case Table():
            block = replace(block, name=prefix + block.name)
            block.data.to_csv(target / f"{block.name}.csv", index=False)
        case Figure():
            block = replace(block, name=prefix + block.name)
            block.drawing.savefig(target / f"{block.name}.png", dpi=style.DPI)
    return block
