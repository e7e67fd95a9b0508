"""A page of tables and figures: Markdown, a CSV per table, a PNG per figure."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from report.document.escape import csv_frame, markdown
from report.document.numbers import as_number, significant
from report.figures import style

NAME = "study.md"
LARGE = 1e5  # numbers from here on have a power of ten


class Page:
    """Collects its paragraphs; the files of tables and figures are written at once."""

    def __init__(self, folder: Path, title: str) -> None:
        folder.mkdir(exist_ok=True)
        self.folder, self.paragraphs = folder, [f"# {title}"]

    def text(self, paragraph: str) -> None:
        self.paragraphs.append(paragraph)

    def table(self, name: str, caption: str, lines: list[dict[str, Any]]) -> None:
        """The lines under their keys: numbers to three digits, in NAME.csv to all."""
        frame = pd.DataFrame(lines, dtype=object)
        csv_frame(frame).to_csv(self.folder / f"{name}.csv", index=False)
        align = ["left" if all(isinstance(cell, str) for cell in frame[name]) else "right" for name in frame]
        shown = frame.map(_shown).to_markdown(index=False, disable_numparse=True, colalign=align)
        self.paragraphs += [f"{caption} ([CSV]({name}.csv))", shown]

    def figure(self, name: str, caption: str, drawing: Figure) -> None:
        drawing.savefig(self.folder / f"{name}.png", dpi=style.DPI)
        self.paragraphs += [f"![{name}]({name}.png)", caption]

    def write(self) -> Path:
        path = self.folder / NAME
        path.write_text(markdown("\n\n".join(self.paragraphs)) + "\n", "utf-8")
        return path


def _shown(cell: object) -> str:
    if isinstance(cell, str):
        return cell.replace("|", r"\|")
    number = as_number(cell)
    whole = number is not None and number.is_integer() and abs(number) < LARGE
    return f"{number:.0f}" if whole else significant(number)
