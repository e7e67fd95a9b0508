"""Writes every report: Markdown from sections, with a PNG per figure and a CSV per table beside it."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import jinja2
import pandas as pd

from report.document.blocks import Figure, Section, Table
from report.document.escape import csv_frame, markdown, picture, short
from report.figures import style

#: A picture or table beside a page, as the page names it; a bracket of a quoted text has a backslash.
LINK = re.compile(r"(?<!\\)\]\(([^()/\\]+\.(?:png|csv))\)")
BESIDE = ("index.html", "sheet.pdf")
TALLEST = 2**16 - 1  # pixels: more are not drawn by Matplotlib 3.9, nor shown by browsers


def written(
    path: Path,
    title: str,
    sections: Sequence[Section],
    intro: Sequence[str] = (),
    files: Mapping[str, pd.DataFrame] = MappingProxyType({}),
) -> Path:
    """Write PATH and the files of its tables and figures; returns PATH.

    intro : paragraphs below the title. files : tables that are not shown, by the names of their CSV files.
    Raises ValueError, before anything is written, if two blocks would have the same file.
    """
    sources: dict[str, str] = {}
    for section in sections:
        for name in (name for block in section.blocks for name in block.files):
            if name in sources:
                both = f"the sections {sources[name]!r} and {section.title!r}"
                raise ValueError(f"{name} would be written by {both}: rename a table or figure of one")
            sources[name] = section.title
    with style.applied():
        for block in (block for section in sections for block in section.blocks):
            if isinstance(block, Figure):
                dpi = min(style.DPI, TALLEST / block.drawing.get_figheight())
                picture(block.drawing).savefig(path.parent / f"{block.name}.png", dpi=dpi)
            if isinstance(block, Figure | Table) and block.name and block.data is not None:
                csv_frame(block.data).to_csv(path.parent / f"{block.name}.csv", index=False)
    for name, table in files.items():
        csv_frame(table).to_csv(path.parent / f"{name}.csv", index=False)
    environment = jinja2.Environment(trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    template = environment.from_string((Path(__file__).parent / "sections.md.j2").read_text("utf-8"))
    page = template.render(title=short(title, 150), sections=sections, intro=intro)
    path.write_text(markdown(page), "utf-8")
    return path


def emptied(directory: Path, page: str = "report.md") -> Path:
    """The directory, made if need be, without the files of an older report: its page names them."""
    directory.mkdir(parents=True, exist_ok=True)
    if (older := directory / page).is_file():
        for name in (*LINK.findall(older.read_text("utf-8", "replace")), *BESIDE):
            (directory / name).unlink(missing_ok=True)
    return directory
