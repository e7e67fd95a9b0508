"""Writes the report of a results directory: Markdown with pictures and tables, and a page in HTML."""

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from report.analysis.checks import warnings
from report.document.blocks import Block, Section, Text
from report.document.numbers import counted, listed
from report.figures import style
from report.page.page_file import write as write_page
from report.page.run_page_data import run_data
from report.results.reader import Results, read
from report.sections import SECTIONS

from .sections_writer import emptied, written

LONG = 4  # sections, from which a report begins with links to them


def write(directory: Path) -> Path:
    """Write DIRECTORY/report/report.md from the results in DIRECTORY, and a page beside it; returns its path.

    Raises FileNotFoundError if DIRECTORY has no measurements.jsonl.
    """
    results = read(directory)
    machines = results.by_machine()
    with style.applied():
        sections = [
            section for k, part in enumerate(machines) for section in _made(part, k if machines[1:] else None)
        ]
    description = results.suite.get("description") if len(results.rows) else ""
    intro = [str(description or _measured(results))]
    intro += [f"> **Warning.** {warning}" for warning in warnings(results)]
    if len(sections) >= LONG:
        intro.append(f"Contents: {contents([section.title for section in sections])}")
    data = run_data(results)
    target = emptied(directory / "report")  # now that nothing of the older one is lost
    write_page(target / "index.html", results.title, data, directory)
    return written(target / "report.md", results.title, sections, intro)


def _measured(results: Results) -> str:
    """'3 solvers on 1 scene, in the dual and primal forms.'"""
    rows = results.rows[results.rows["status"] != "unsupported"]
    if rows.empty:
        return "Nothing was measured."
    counts = [counted(rows[name].nunique(), name) for name in ("solver", "scene")]
    forms = sorted(rows["form"].unique())
    return f"{counts[0]} on {counts[1]}, in the {listed(forms)} form{'s' if forms[1:] else ''}."


def contents(titles: Iterable[str]) -> str:
    """Links to the headings of these titles, in one paragraph; equal titles lead to one heading each."""
    seen: Counter[str] = Counter()
    links = []
    for title in titles:
        anchor = re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")  # as GitHub names it
        again = f"-{seen[anchor]}" if seen[anchor] else ""
        seen[anchor] += 1
        links.append(f"[{title}](#{anchor}{again})")
    return " · ".join(links)


def _made(results: Results, machine: int | None) -> list[Section]:
    """The sections that these results have. machine : its place, if there are several; titles then name it,
    and file names begin with its number from the second on.
    """
    parts = {about: results.about(about) for about, _ in SECTIONS}
    made = [section for about, of in SECTIONS if len(parts[about].rows) and (section := of(parts[about]))]
    if machine is None:
        return made
    name = results.rows["machine"].iloc[0] or "machine not recorded"
    prefix = f"machine{machine + 1}-" if machine else ""
    return [
        Section(f"{section.title}: {name}", [_renamed(block, prefix) for block in section.blocks])
        for section in made
    ]


def _renamed(block: Block, prefix: str) -> Block:
    return block if isinstance(block, Text) else replace(block, name=prefix + block.name)
