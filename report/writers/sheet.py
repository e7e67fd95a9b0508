"""Writes one page to file: verdict, pictures, tables, how sure it is, input files with their hashes, origin.

The page is 210 × 279 mm, so that it prints at full size on A4 and on US letter.
"""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from textwrap import wrap
from typing import Any

from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.image import imread
from matplotlib.textpath import text_to_path

from report.document.blocks import Table, records
from report.document.escape import plain
from report.document.numbers import as_number, raised, significant
from report.document.verdict_colours import COLOURS, FAIL
from report.figures import style
from report.page.page_file import minute

PAGE = (210 / 25.4, 279 / 25.4)  # inches
LEFT, WIDTH, TOP, LINE, LOWEST = 0.07, 0.86, 0.96, 0.0145, 0.035  # of the page
TALLEST, LEAST = 0.5, 0.16  # of a picture
LETTERS, LETTER, GAP = 125, 0.0072, 0.03  # of a line; width of a letter, and between columns, of the page
LEAST_LINES = 4  # of each table, before pictures shrink
SMALL = 7.5  # points, of tables that fit
MOST_FILES, LONGEST = 24, 40  # that are named; letters of a name, its last ones
DIGITS = 12  # of a hash
GREY = "#555555"
FINEST = 1e-6  # mm: a smaller error is said to be this
MESH = "The mesh error is not part of it; the sheet of a single joint has it."


@dataclass(frozen=True)
class Sheet:
    """The content of a sheet. kind : of the verdict, "pass", "fail" or "". sure, origin : sentences.

    inputs : SHA-256 of the files that were read, by name; MOST_FILES are shown. tables : what does not fit of
    them is left out.
    """

    title: str
    kind: str
    verdict: str
    sure: list[str]
    origin: list[str]
    inputs: dict[str, str]
    pictures: list[Path] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


@style.applied()
def write_sheet(path: Path, sheet: Sheet) -> None:
    """Write one page; pictures shrink, and tables end earlier, where there is no room."""
    page = _Page()
    page.text(sheet.title, size=13, weight="bold", letters=66)
    page.text(sheet.verdict, size=11, weight="bold", color=COLOURS[sheet.kind], letters=76)
    for sentence in sheet.warnings:
        page.text(f"{sentence}.", color=FAIL)
    names = (name if len(name) <= LONGEST else f"…{name[-LONGEST:]}" for name in sheet.inputs)
    pairs = zip(names, sheet.inputs.values(), strict=True)
    files = [f"{name}, SHA-256 {digits[:DIGITS]}" for name, digits in pairs]
    more = [f"and {len(files) - MOST_FILES} more"] if len(files) > MOST_FILES else []
    inputs = [f"Input files: {'; '.join([*files[:MOST_FILES], *more])}."] if files else []
    sure = [line for text in (*sheet.sure, *inputs, *sheet.origin) for line in lines_of(text)]
    tables = [Printed(table) for table in sheet.tables if len(table.data)]
    rows = [table.rows + 3 for table in tables]
    least = [min(count, LEAST_LINES + 3) for count in rows]
    room = page.at - LOWEST - (len(sure) + 2) * LINE
    pictures = len(sheet.pictures)
    share = max(room - sum(rows) * LINE, min(room - sum(least) * LINE, LEAST * pictures)) / max(pictures, 1)
    for file in sheet.pictures:
        page.picture(file, share - LINE)
    for k, table in enumerate(tables):
        page.table(table, page.at - LOWEST - (len(sure) + 2 + sum(least[k + 1 :])) * LINE)
    page.text("How sure it is, and from what", weight="bold")
    for line in sure:
        page.text(line, letters=2 * LETTERS)
    page.figure.savefig(path, format="pdf", dpi=style.DPI)


def exactness(error_mm: Any) -> str:
    """How exact the calculation is, in a sentence. error_mm : a bound, if there is one."""
    if as_number(error_mm) is None:
        return "How exact the calculation is could not be shown."
    error = f"{FINEST:f}" if error_mm <= FINEST else significant(raised(error_mm, 2), 2)
    return f"The calculation is exact to {error} mm for this model."


def origin(record: dict[str, Any]) -> list[str]:
    """Scene, program, machine and date, as far as they are recorded, and the date of the sheet."""
    parts = {
        "Scene": f"{record['scene']}, key {record.get('scene_key', '')}",
        "Program": f"rivetbench {record.get('version', '')}, commit {str(record.get('commit'))[:DIGITS]}",
        "Machine": record.get("machine"),
        "Computed": record.get("recorded_at") and minute(record["recorded_at"]),
        "Printed": minute(datetime.now(UTC).isoformat()),
    }
    return [". ".join(f"{name}: {text}" for name, text in parts.items() if text) + "."]


def lines_of(text: str, letters: int = LETTERS, **look: Any) -> list[str]:
    """The text in lines of so many letters, or of fewer, wide ones. look : of FontProperties."""
    lines, font = wrap(plain(text), letters), FontProperties(**{"size": 8.0} | look)
    width = max(
        (text_to_path.get_text_width_height_descent(line, font, False)[0] for line in lines), default=0
    )
    return lines if width <= WIDTH * PAGE[0] * 72 else lines_of(text, letters - 5, **look)


class Printed:
    """A table as printed: its cells as texts, the widths of its columns, the blocks that fit side by side.

    A column whose cells are all the same stands in the title instead. Where the rest is wider than the
    page, letters are smaller.
    """

    def __init__(self, table: Table) -> None:
        rows = records(table.data)
        columns = [[column.heading, *(plain(column.show(row)) for row in rows)] for column in table.columns]
        kept = [texts for texts in columns if len(rows) == 1 or len(set(texts[1:])) > 1] or columns
        same = [f"{texts[0]}: {texts[1]}" for texts in columns if texts not in kept]
        self.title = "; ".join([table.caption.split("*")[1].rstrip(".:"), *same])
        self.file = f"{table.name}.csv"
        self.heads, *self.lines = zip(*kept, strict=True)
        widths = [max(map(len, texts)) * LETTER + GAP / 2 for texts in kept]
        scale = min(WIDTH / sum(widths), 1.0)
        self.size, self.widths = scale * SMALL, [scale * width for width in widths]
        self.blocks = max(int((WIDTH + GAP) / (sum(self.widths) + GAP)), 1)
        self.rows = -(-len(self.lines) // self.blocks)


class _Page:
    """A page that is filled from the top."""

    def __init__(self) -> None:
        self.figure, self.at = Figure(figsize=PAGE), TOP

    def text(self, text: str, size: float = 8.0, letters: int = LETTERS, **look: Any) -> None:
        for line in lines_of(text, letters, size=size, weight=look.get("weight")):
            self.cell(LEFT, line, size=size, **look)
            self.at -= LINE * size / 8.0

    def cell(self, x: float, text: str, **look: Any) -> None:
        self.figure.text(x, self.at, text, va="top", parse_math=False, **look)

    def table(self, table: Printed, room: float) -> None:
        """Its lines in blocks side by side, as many as fit; the title says how many are left."""
        rows = min(table.rows, max(int(room / LINE) - 3, 1))
        more = len(table.lines) - rows * table.blocks
        left_out = f"; {more} more: {table.file}" if more > 0 else ""
        self.text(f"{table.title}{left_out}", weight="bold")
        top = self.at
        for block in range(min(table.blocks, -(-len(table.lines) // rows))):
            self.at = top
            for line in (table.heads, *table.lines[block * rows : (block + 1) * rows]):
                right = LEFT + block * (sum(table.widths) + GAP)
                for text, width in zip(line, table.widths, strict=True):
                    right += width
                    color = GREY if line is table.heads else "black"
                    self.cell(right - GAP / 2, text, size=table.size, ha="right", color=color)
                self.at -= LINE
        self.at = top - (rows + 2) * LINE

    def picture(self, file: Path, most: float) -> None:
        image = imread(file)
        height = WIDTH * image.shape[0] / image.shape[1] * PAGE[0] / PAGE[1]
        shown = min(height, TALLEST, max(most, LEAST / 2))
        axes = self.figure.add_axes((LEFT, self.at - shown, WIDTH * shown / height, shown))
        axes.imshow(image, interpolation="none")
        axes.set_axis_off()
        self.at -= shown + LINE
