"""Writes the report of a results directory: Markdown, a PNG per figure, a CSV per table, a page in HTML."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from report.analysis.checks import warnings
from report.document.blocks import Block, Section, Text
from report.figures import style
from report.page.run import run_data
from report.page.write import write as write_page
from report.results.reader import Results, read
from report.sections import SECTIONS

from .sections_writer import emptied, written

LONG = 4  # sections, from which a report begins with links to them


def write(directory: Path) -> Path:
    """Write DIRECTORY/report/report.md from the results in DIRECTORY, and index.html beside it.

    Returns the path of the former.

    Raises FileNotFoundError if DIRECTORY has no measurements.jsonl.
    """
    results = read(directory)
    target, machines = emptied(directory / "report"), results.by_machine()
    with style.applied():
        sections = [
            section for k, part in enumerate(machines) for section in _made(part, k if machines[1:] else None)
        ]
    intro = [str(results.suite.get("description", ""))]
    intro += [f"> **Warning.** {warning}" for warning in warnings(results)]
    if results.rows.empty:
        intro.append("Nothing was measured: `measurements.jsonl` holds no row.")
    if len(sections) >= LONG:
        intro.append(f"Contents: {contents([section.title for section in sections])}")
    write_page(target / "index.html", results.title, run_data(results), directory)
    return written(target / "report.md", results.title, sections, [text for text in intro if text])


def contents(titles: Iterable[str]) -> str:
    """Links to headings of these titles, in one paragraph; equal titles lead to one heading each, in turn."""
    seen: Counter[str] = Counter()
    links = []
    for title in titles:
        anchor = re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")  # as GitHub names it
        again = f"-{seen[anchor]}" if seen[anchor] else ""
        seen[anchor] += 1
        links.append(f"[{title}](#{anchor}{again})")
    return " · ".join(links)


def _made(results: Results, machine: int | None) -> list[Section]:
    """The sections that have something to say of the results. machine : its place, if there are several; it
    is in the titles, and from the second on in the names of files.
    """
    parts = {about: results.about(about) for about, _ in SECTIONS}
    made = [section for about, of in SECTIONS if len(parts[about].rows) and (section := of(parts[about]))]
    if machine is None:
        return made
    name = results.rows["machine"].iloc[0] or "machine not recorded"
    prefix = f"machine{machine + 1}-" if machine else ""
    return [
        Section(f"{section.title}: {name}", [_renamed(each, prefix) for each in section.blocks])
        for section in made
    ]


def _renamed(block: Block, prefix: str) -> Block:
    return block if isinstance(block, Text) else replace(block, name=prefix + block.name)
