"""Writes an answer on one A4 page: verdict, pictures, error bound, origin."""

from pathlib import Path
from textwrap import wrap
from typing import Any

from matplotlib.figure import Figure
from matplotlib.image import imread

from report.document.escape import plain
from report.document.numbers import position, significant
from report.figures import style
from report.page.answer_page_data import facts, headline, stage_lines
from report.page.page_file import minute
from report.results.answer_record import fasteners
from report.results.series_results import Array

A4 = (8.27, 11.69)  # inches
LEFT, WIDTH, TOP, LINE, LOWEST = 0.07, 0.86, 0.965, 0.0145, 0.03  # of the page
TALLEST, LEAST = 0.3, 0.08  # of a picture
COLOURS = {"pass": style.BLUE, "fail": "#B3261E", "": style.BLACK}  # as in page.css
LETTERS = 105  # of a line
STAGES, FEW, HEADINGS = 8, 4, 6  # lines: of the history, of forces for which there is room, of headings


def write_pdf(path: Path, record: dict[str, Any], arrays: dict[str, Array], pictures: list[Path]) -> None:
    """A4, with those pictures below the headline, and as many of the fasteners as fit."""
    page, verdict = _Page(), headline(record, arrays)
    page.text(str(record["title"]), size=13, weight="bold", letters=70)
    page.text(verdict["text"], size=11, weight="bold", color=COLOURS[verdict["kind"]], letters=85)
    for sentence in record.get("unusual", ()):
        page.text(f"{sentence}.", color=COLOURS["fail"])
    origin = [("scene", f"{record['scene']}, key {record['scene_key'][:16]}"), *facts(record)]
    origin += [(name, str(record[name])) for name in ("commit", "machine") if record.get(name)]
    if record.get("recorded_at"):
        origin.append(("computed", minute(record["recorded_at"])))
    forces = [
        f"{kind}, {contact}, at {position((x, y), arrays['nodes'])}: {significant(force)} N"
        for kind, contact, x, y, force in fasteners(record).itertuples(index=False)
    ]
    heads, *stages = stage_lines(record, arrays)
    history = [" | ".join(line) for line in (heads, *stages[-STAGES:]) if stages]
    below = len(origin) + len(history) + min(len(forces), FEW) + HEADINGS
    most = (page.at - LOWEST - below * LINE) / max(len(pictures), 1) - LINE
    for file in pictures:
        page.picture(file, most)
    page.lines("Stages, the last ones", history)
    room = max(int((page.at - LOWEST) / LINE) - len(origin) - 4, 0)
    if len(forces) > room:
        forces = [*forces[:room], f"and {len(forces) - room} more: answer.md"]
    page.lines("Forces in the fasteners", forces)
    sure = [f"{record['grid']['said']}.", *(f"{name}: {value}" for name, value in origin)]
    page.lines("How sure it is, and from what", sure)
    page.figure.savefig(path, format="pdf", dpi=style.DPI)


class _Page:
    """A page that is filled from the top."""

    def __init__(self) -> None:
        self.figure, self.at = Figure(figsize=A4), TOP

    def text(self, text: str, size: float = 8.0, letters: int = LETTERS, **look: Any) -> None:
        for line in wrap(plain(text), letters):
            self.figure.text(LEFT, self.at, line, va="top", size=size, parse_math=False, **look)
            self.at -= LINE * size / 8.0

    def lines(self, heading: str, lines: list[str]) -> None:
        for line in [heading, *lines] if lines else ():
            self.text(line, weight="bold" if line is heading else "normal")

    def picture(self, file: Path, most: float) -> None:
        image = imread(file)
        height = WIDTH * image.shape[0] / image.shape[1] * A4[0] / A4[1]
        shown = min(height, TALLEST, max(most, LEAST))
        axes = self.figure.add_axes((LEFT, self.at - shown, WIDTH * shown / height, shown))
        axes.imshow(image, interpolation="none")
        axes.set_axis_off()
        self.at -= shown + LINE
