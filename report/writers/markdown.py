"""Writes the report of a results directory: Markdown, a PNG per figure, a CSV per table, a page in HTML."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from report.analysis.checks import warnings
from report.document.blocks import Block, Figure, Section, Table
from report.document.contents import contents
from report.document.escape import csv_frame, picture
from report.figures import style
from report.page.run import run_data
from report.page.write import write as write_page
from report.results.reader import Results, read

from .discovery import sections
from .pages import rendered

LONG = 4  # sections, from which a report begins with links to them


def write(directory: Path) -> Path:
    """Write DIRECTORY/report/report.md from the results in DIRECTORY, and index.html beside it.

    Returns the path of the former.

    Raises FileNotFoundError if DIRECTORY has no measurements.jsonl.
    """
    results = read(directory)
    target = directory / "report"
    target.mkdir(exist_ok=True)
    for stale in [*target.glob("*.png"), *target.glob("*.csv")]:
        stale.unlink()
    parts = []
    with style.applied():
        for i, part in enumerate(results.by_machine()):
            parts.append((part, [_save(section, target, i) for section in _made(part)]))
    path = target / "report.md"
    titles = [section.title for _, made in parts for section in made]
    links = contents(titles) if len(titles) >= LONG else ""
    page = rendered("report.md.j2", results=results, parts=parts, warnings=warnings(results), contents=links)
    path.write_text(page, "utf-8")
    title = str(results.suite.get("title") or "Results")
    write_page(target / "index.html", title, run_data(results), directory)
    return path


def _made(results: Results) -> list[Section]:
    """The sections that have something to say of the results, in their order."""
    made = [module.section(results.about(module.PLACE.about)) for module in sections()]
    return [section for section in made if section]


def _save(section: Section, target: Path, machine: int) -> Section:
    """Write the section's files; from the second machine on, their names begin with its number."""
    prefix = f"machine{machine + 1}-" if machine else ""
    return replace(section, blocks=[save_block(block, target, prefix) for block in section.blocks])


def save_block(block: Block, target: Path, prefix: str = "") -> Block:
    """Write a table's CSV or a figure's PNG; returns the block with the name of its file."""
    match block:
        case Table():
            block = replace(block, name=prefix + block.name)
            csv_frame(block.data).to_csv(target / f"{block.name}.csv", index=False)
        case Figure():
            block = replace(block, name=prefix + block.name)
            picture(block.drawing).savefig(target / f"{block.name}.png", dpi=style.DPI)
    return block
