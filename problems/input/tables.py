"""Tables of numbers from any program: CSV files, all read by the same rules.

    separator   what the header has of ; tab and comma, in this order, or what a line sep=; says
    header      the first line that has the headings; what is above it is skipped, as are empty lines
    comments    lines of one cell that begins with # and a blank
    stray       nothing stands under an empty heading but in the first column, an index
    unit        mm, unless a heading ends in another one or a row of units follows: converted
    decimal     one mark a file: that of the first number which can be read in one way only; without such a
                number the point, if commas separate the cells
    thousands   the other mark, a blank or an apostrophe, if all numbers of the column agree

A number that may be two, 1.250 among ; and nothing else, is refused.
"""

from __future__ import annotations

import csv
import math
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import islice, zip_longest
from pathlib import Path

from problems.errors import Fault, InputError

from .bounded_types import LARGEST
from .text_files import read_text

CSV_MIB = 100
MAX_FAULTS = 10  # reported one by one; the rest are counted
NO_UNIT = {"": Fraction(1), "-": Fraction(1)}
LENGTHS = NO_UNIT | {
    unit: Fraction(mm)
    for names, mm in {
        "mm millimeter millimetre": "1",
        "cm": "10",
        "dm": "100",
        "m meter metre": "1000",
        "um \u03bcm micron microns": "0.001",
        "nm": "0.000001",
        'in inch inches "': "25.4",
        "ft": "304.8",
        "mil mils thou": "0.0254",
    }.items()
    for unit in names.split()
}
#: Of columns that are no lengths, by name.
UNITS = dict.fromkeys(("id", "nx", "ny", "nz", "contact"), NO_UNIT)
BARE = "|".join(sorted({*LENGTHS} - {*NO_UNIT, '"'}, key=len, reverse=True))
HEADING = re.compile(rf"(.*?)(?:\s*[\[({{]\s*(.*?)\s*[\])}}]|[\s_/,:-]+(?:in\s+)?({BARE}))")
PLAIN = re.compile(r"[+-]?(?:\d+(?:([.,])\d*)?|([.,])\d+)(?:e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
APART = ".,' \u2019\u00a0\u2009\u202f"  # what may part thousands
GROUPS = re.compile(rf"[+-]?[1-9]\d{{0,2}}([{APART}])\d{{3}}(?:\1\d{{3}})*(?:(?!\1)([.,])\d+)?", re.ASCII)
OTHER = {".": ",", ",": "."}
STRAY = "no more cells than headings, and none under an empty heading"


@dataclass(frozen=True)
class Rows:
    """The good rows of a file, their line numbers, and the faults."""

    path: Path
    rows: list[tuple[float, ...]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)


@dataclass(frozen=True)
class Cells:
    """The lines of a file, from `start` on without the header."""

    path: Path
    text: list[str]
    delimiter: str
    header: list[str]
    start: int

    @classmethod
    def of(cls, path: Path, mib: float, wanted: Iterable[str], skip: int = 0) -> Cells:
        """Its header is the first line that has these headings, in small letters and without units; if there
        is none, or nothing is wanted, it is empty. Raises InputError.
        """
        text, wanted = read_text(path, "file", mib).split("\n"), set(wanted)
        skip = min(skip, len(text) - 1)
        first = next((k for k in range(skip, len(text)) if _is_content(text[k])), skip)
        said = re.fullmatch(r"\s*\"?sep=(.)\"?[\s;,]*", "".join(text[first : first + 1]))
        for k in range(skip, len(text) if wanted else 0):
            delimiter = said[1] if said else _delimiter(text[k])
            header = _cells(text[k].lstrip("# "), delimiter)
            if wanted <= {heading(cell)[0] for cell in header}:
                return cls(path, text, delimiter, header, k + 1)
        return cls(path, text, said[1] if said else _delimiter(text[first]), [], first + 1 if said else skip)

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """The number of each line that has a cell, and its cells. Raises InputError."""
        reader = csv.reader(islice(self.text, self.start, None), delimiter=self.delimiter)
        try:
            for cells in reader:
                texts = [cell.strip().replace("\u2212", "-") for cell in cells]
                comment = texts[:1] and texts[0].split()[:1] == ["#"] and not any(texts[1:])
                if any(text.strip(";,") for text in texts) and not comment:
                    yield self.start + reader.line_num, texts
        except csv.Error as error:
            raise InputError.one(self.path, "file", str(error), "a readable CSV file") from error

    def decimal_mark(self, columns: Sequence[int]) -> str:
        """That of the numbers in some columns; empty if it cannot be told."""
        for _, cells in self.rows():
            for text in (cells[k] for k in columns if k < len(cells)):
                plain, groups = PLAIN.fullmatch(text), GROUPS.fullmatch(text)
                mark = (plain[1] or plain[2]) if plain else groups and (groups[2] or OTHER.get(groups[1]))
                if mark and not (plain and groups):
                    return mark
        return "." if self.delimiter == "," else ""


def read_columns(
    path: Path,
    headings: Mapping[str, str],
    skip_lines: int = 0,
    missing: Iterable[float | str] = (),
) -> Rows:
    """The columns of a file, row by row, by name and heading; others are ignored. Bad rows are faults.

    missing : numbers and words in the last column that mark a row without a value; it is left out.
    """
    read = Rows(path)
    try:
        table = Cells.of(path, CSV_MIB, [heading(text)[0] for text in headings.values()], skip_lines)
        _read(table, headings, [str(mark).strip().lower() for mark in missing], read)
    except InputError as error:
        read.faults.extend(error.faults)
    if (more := len(read.faults) - MAX_FAULTS) > 1:
        read.faults[MAX_FAULTS:] = [Fault(str(path), "lines", f"{more} more", read.faults[-1].allowed)]
    return read


def _read(table: Cells, headings: Mapping[str, str], missing: list[str], read: Rows) -> None:
    there, listed = [heading(cell) for cell in table.header], ", ".join(headings.values())
    names = [name for name, _ in there]
    wanted = [heading(text)[0] for text in headings.values()]
    if any(names.count(name) != 1 for name in wanted):
        line = table.start + (not table.header)
        allowed = f"a header line with the columns {listed}, once each"
        raise InputError.one(table.path, f"line {line}", table.text[line - 1], allowed)
    columns = [names.index(name) for name in wanted]
    scales = [UNITS.get(name, LENGTHS) for name in headings]
    mark, marks = table.decimal_mark(columns), {number(word, ".")[0] for word in missing}
    marks.discard(math.nan)
    units, seen, below = [there[k][1] for k in columns], [""] * len(columns), True
    for line, cells in table.rows():
        texts = [cells[k] if k < len(cells) else "" for k in columns]
        row = [_plain(text).strip("[](){} ") for text in texts] if below else []
        if any(row) and all(unit in scale for unit, scale in zip(row, scales, strict=True)):
            both = zip(units, row, strict=True)
            units = [new if old in ("", new) else f"{old}, {new}" for old, new in both]
            continue
        for unit, scale in zip(units, scales, strict=True):
            if unit not in scale:
                allowed = f"a unit: {', '.join(filter(None, scale))}"
                raise InputError.one(table.path, f"line {table.start}, unit", unit, allowed)
        below = False
        numbers = [number(text, mark) for text in texts]
        if texts[-1].lower() in missing or numbers[-1][0] in marks:
            continue
        fault = ""
        if is_stray(names, cells):
            fault = STRAY
        elif not all(abs(value) <= LARGEST for value, _ in numbers):
            fault = doubt(texts, mark) or f"a finite number up to {LARGEST:g} in each column: {listed}"
        elif any(new and old and new != old for (_, new), old in zip(numbers, seen, strict=True)):
            fault = "thousands written alike in the whole column"
        if fault:
            read.faults.append(Fault(str(table.path), f"line {line}", table.delimiter.join(cells), fault))
            if fault == STRAY and not read.rows:
                return
            continue
        seen = [old or new for (_, new), old in zip(numbers, seen, strict=True)]
        factors = [scale[unit] for unit, scale in zip(units, scales, strict=True)]
        scaled = zip(numbers, factors, strict=True)
        read.rows.append(tuple(value * by.numerator / by.denominator for (value, _), by in scaled))
        read.lines.append(line)
    if not read.rows and not read.faults:
        read.faults.append(Fault(str(table.path), "rows", 0, "at least one row below the header"))


def is_stray(names: Sequence[str], cells: Sequence[str]) -> bool:
    """Whether a cell stands under no heading: 0,5 would be two cells. The first column may be an index."""
    return any(cell and not name for name, cell in list(zip_longest(names, cells, fillvalue=""))[1:])


def headings(path: Path, wanted: Iterable[str] = ("id", "x", "y", "z")) -> list[str]:
    """The headings of a file beside those that are wanted; none if it cannot be read."""
    try:
        return [heading(cell)[0] for cell in Cells.of(path, CSV_MIB, wanted).header]
    except InputError:
        return []


def number(text: str, mark: str) -> tuple[float, str]:
    """Its value, NaN if it is no number; and what parts its thousands, "none" if nothing does, or "" where it
    has none. mark : of decimals, empty if it is not known.
    """
    plain, groups = PLAIN.fullmatch(text), GROUPS.fullmatch(text)
    if plain and (plain[1] or plain[2] or mark) == mark:
        value = float(text.replace(mark or ".", "."))
        return value, "none" if abs(value) >= 1000 else ""
    if groups and groups[1] != mark and (groups[2] or mark) == mark and (mark or groups[1] not in OTHER):
        return float(text.replace(groups[1], "").replace(mark or ".", ".")), groups[1]
    return math.nan, ""


def doubt(texts: Iterable[str], mark: str) -> str:
    """What to write in place of the first of these that may be two numbers, or has another decimal mark."""
    for text in texts:
        plain, groups = PLAIN.fullmatch(text), GROUPS.fullmatch(text)
        if not math.isnan(number(text, mark)[0]):
            continue
        if plain and groups and not mark:
            whole = re.sub("[.,]", "", text)
            return f"numbers with one meaning: {text} may be {whole}; write {whole}, or {text}0 if it is not"
        if (plain or groups) and mark:
            return f"{mark!r} as the decimal mark, as above in this file; not so in {text}"
    return ""


def heading(cell: str) -> tuple[str, str]:
    """The name and the unit of a heading, both in small letters; the unit may be empty."""
    text = _plain(cell)
    if not (parts := HEADING.fullmatch(text)) or not parts[1]:
        return text, ""
    unit = parts[2] or parts[3] or ""
    return (parts[1] if unit in LENGTHS else text), unit


def _plain(cell: str) -> str:
    return unicodedata.normalize("NFKC", cell).strip().lower()


def _cells(line: str, delimiter: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:
        return []


def _is_content(line: str) -> bool:
    return bool(line.strip(" ;,\t")) and not line.lstrip().startswith("#")


def _delimiter(line: str) -> str:
    return next((mark for mark in ";\t" if mark in line), ",")
