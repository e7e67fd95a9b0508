"""Tables of numbers from any program: CSV files, all read by the same rules.

    separator   the first of ; tab and comma that the header has, or the one that a line sep=; names
    header      the first line with the headings; the lines above it and empty lines are skipped
    comments    lines of one cell that begins with # and a blank
    stray       a cell under an empty heading is refused, but in the first column, which may be an index
    unit        mm, unless a heading ends in another unit or a row of units follows: converted
    decimal     one mark per file: that of the first number that can be read in one way only; without such a
                number the point, if commas separate the cells
    thousands   the other mark, a blank or an apostrophe, if all numbers of the column agree

A number with two readings, such as 1.250 between semicolons, is refused.
"""

import csv
import math
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import islice, zip_longest
from pathlib import Path

from problems.errors import Fault, InputError

from .bounded_types import LARGEST
from .text_files import read_text

CSV_MIB = 100
MOST_COLUMNS = 3  # of --columns: x, y and a value
MAX_FAULTS = 10  # reported one by one; the rest are counted
NO_UNIT = {"": Fraction(1), "-": Fraction(1)}
LENGTHS = NO_UNIT | {"mm": Fraction(1), "m": Fraction(1000), "ft": Fraction("304.8")}
LENGTHS |= dict.fromkeys(("um", "\u03bcm"), Fraction("0.001"))
LENGTHS |= dict.fromkeys(("in", "inch", '"'), Fraction("25.4"))
#: The units of columns that are no lengths, by name.
FORCES = NO_UNIT | {"n": Fraction(1), "kn": Fraction(1000)}
UNITS = dict.fromkeys(("id", "nx", "ny", "nz", "contact"), NO_UNIT) | {"preload": FORCES}
WORDS = ("name", "stage", "side")  # headings of columns of words
BARE = "|".join(sorted({*LENGTHS} - {*NO_UNIT, '"'}, key=len, reverse=True))
FORCE = r"[kmd]?a?n|lbf?|kips?|kgf?|kp|\w.*[\[({].*"  # also those that are refused
HEADING = re.compile(
    rf"(preload)[\s_/,:-]+(?:in\s+)?({FORCE})|(.*?)\s*[\[({{]\s*(.*?)\s*[\])}}]"
    rf"|(.*?)[\s_/,:-]+(?:in\s+)?({BARE})"
)
UNIT = rf"(?:\s*[\[({{].*|[\s_/,:-]+(?:in\s+)?(?:k?n(?:/mm)?|{BARE}))?"
PLAIN = re.compile(r"[+-]?(?:\d+(?:([.,])\d*)?|([.,])\d+)(?:e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
APART = ".,' \u2019\u00a0\u2009\u202f"  # separators of thousands
GROUPS = re.compile(rf"[+-]?[1-9]\d{{0,2}}([{APART}])\d{{3}}(?:\1\d{{3}})*(?:(?!\1)([.,])\d+)?", re.ASCII)
OTHER = {".": ",", ",": "."}
STRAY = "no more cells than headings, and none under an empty heading"


@dataclass(frozen=True)
class TableOptions:
    """How a user's table is read; the same for a file of a scene and for one of the command line.

    columns : the headings, in the order in which the reader names the columns; by default these names. Three
        may be given where two are read.
    missing : numbers and words that mark a value that is not there.
    skip_lines : the number of lines above the header, if a heading occurs in one of them.
    """

    columns: tuple[str, ...] = ()
    missing: tuple[float | str, ...] = ()
    skip_lines: int = 0

    def headings(self, names: Sequence[str]) -> dict[str, str]:
        """The heading of each column by its name. Raises InputError if there are too few, or too many."""
        count = len({*map(_plain, self.columns)})
        if self.columns and not len(names) <= count == len(self.columns) <= max(len(names), MOST_COLUMNS):
            allowed = f"a heading for each of {', '.join(names)}, separated by commas"
            raise InputError.one("--columns", "headings", ", ".join(self.columns), allowed)
        return dict(zip(names, self.columns or names, strict=False))

    def is_missing(self, text: str, value: float) -> bool:
        """Whether a cell with this text and value is one of the marks, as a word or as a number."""
        return value in self.numbers or text.lower() in self.words

    @cached_property
    def words(self) -> list[str]:
        """The marks of missing values as small letters."""
        return [str(mark).strip().lower() for mark in self.missing]

    @cached_property
    def numbers(self) -> list[float]:
        """The marks of missing values that are numbers."""
        return [value for word in self.words if not math.isnan(value := number(word, ".")[0])]


AS_NAMED = TableOptions()


@dataclass(frozen=True)
class Rows:
    """The good rows of a file, with their line numbers, and the faults of the others.

    header : the headings. columns : the names of the columns read, in the order of the cells of a row.
    words : the cell of each row under each heading of WORDS; empty without such a column.
    """

    path: Path
    header: list[str] = field(default_factory=list)
    columns: list[str] = field(default_factory=list)
    rows: list[tuple[float, ...]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    words: dict[str, list[str]] = field(default_factory=lambda: {heading: [] for heading in WORDS})
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
    def of(cls, path: Path, mib: float, wanted: Iterable[str], skip: int = 0) -> "Cells":
        """Split a file at its header, the first line with the wanted headings, small and without units.

        The header is empty if no line has them, or nothing is wanted. Raises InputError.
        """
        text, wanted = read_text(path, "file", mib).split("\n"), set(wanted)
        skip = min(skip, len(text) - 1)
        lines = range(skip, len(text))
        first = next((k for k in lines if _is_content(text[k])), skip)
        said = re.fullmatch(r"\s*\"?sep=(.)\"?[\s;,]*", "".join(text[first : first + 1]))
        for k in lines if wanted else ():
            delimiter = said[1] if said else _delimiter(text[k])
            header = _cells(text[k].lstrip("# "), delimiter)
            if wanted <= {heading(cell)[0] for cell in header}:
                return cls(path, text, delimiter, header, k + 1)
        told = said[1] if said else _delimiter(text[next((k for k in lines if _has_number(text[k])), first)])
        return cls(path, text, told, [], first + 1 if said else skip)

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield the number of each line that has a cell, and its cells. Raises InputError."""
        reader, last = csv.reader(islice(self.text, self.start, None), delimiter=self.delimiter), 0
        try:
            for cells in reader:
                if reader.line_num > last + 1 and any(self.delimiter in cell for cell in cells):
                    first, open_until = self.start + last + 1, f"line {self.start + reader.line_num}"
                    allowed = f"no quotation mark that is open until {open_until}"
                    raise InputError.one(self.path, f"line {first}", self.text[first - 1], allowed)
                last = reader.line_num
                texts = [cell.strip().replace("\u2212", "-") for cell in cells]
                comment = texts[:1] and texts[0].split()[:1] == ["#"] and not any(texts[1:])
                if any(text.strip(";,") for text in texts) and not comment:
                    yield self.start + reader.line_num, texts
        except csv.Error as error:
            raise InputError.one(self.path, "file", str(error), "a readable CSV file") from error

    def decimal_mark(self, columns: Sequence[int]) -> str:
        """The decimal mark of the numbers in some columns; empty if no number tells it."""
        for _, cells in self.rows():
            for text in (cells[k] for k in columns if k < len(cells)):
                plain, groups = PLAIN.fullmatch(text), GROUPS.fullmatch(text)
                mark = (plain[1] or plain[2]) if plain else groups and (groups[2] or OTHER.get(groups[1]))
                if mark and not (plain and groups):
                    return mark
        return "." if self.delimiter == "," else ""


def read_columns(
    path: Path, names: Sequence[str], options: TableOptions = AS_NAMED, optional: Sequence[str] = ()
) -> Rows:
    """Read some columns of a file, row by row; others are ignored. Rows that are no numbers are faults.

    optional : the names of columns that need not be there. A row whose last cell is marked as missing is left
    out.
    """
    read = Rows(path)
    try:
        headings = options.headings(names)
        wanted = [heading(text)[0] for text in headings.values()]
        table = Cells.of(path, CSV_MIB, wanted, options.skip_lines)
        there = [heading(cell)[0] for cell in table.header]
        headings |= {name: name for name in optional if name in there}
        read.columns.extend(headings)
        read.header.extend(table.header)
        _read(table, headings, options, read)
    except InputError as error:
        read.faults.extend(error.faults)
    if (more := len(read.faults) - MAX_FAULTS) > 1:
        read.faults[MAX_FAULTS:] = [Fault(str(path), "lines", f"{more} more", read.faults[-1].allowed)]
    return read


def _read(table: Cells, headings: Mapping[str, str], options: TableOptions, read: Rows) -> None:
    there, listed = [heading(cell) for cell in table.header], ", ".join(headings.values())
    names = [name for name, _ in there]
    twice = [word for word in WORDS if names.count(word) > 1]
    alike = [_plain(cell) for cell in table.header]
    places = [
        [k for k in range(len(names)) if alike[k] == _plain(text)]  # one that is named with its unit
        if alike.count(_plain(text)) == 1 and heading(text)[1]
        else [k for k in range(len(names)) if names[k] == heading(text)[0]]
        for text in headings.values()
    ]
    if twice or any(len(place) != 1 for place in places):
        line = table.start + (not table.header)
        allowed = f"a header line with the columns {', '.join([listed, *twice])}, once each"
        raise InputError.one(table.path, f"line {line}", table.text[line - 1], allowed)
    columns = [place for (place,) in places]
    words = {word: names.index(word) for word in WORDS if word in names}
    scales = [UNITS.get(name, LENGTHS) for name in headings]
    mark = table.decimal_mark(columns)
    units, seen, below = [there[k][1] for k in columns], [""] * len(columns), True
    for line, cells in table.rows():
        texts = [cells[k] if k < len(cells) else "" for k in columns]
        row = [_plain(text).strip("[](){} ") for text in texts] if below else []
        if {*row} - NO_UNIT.keys() and all(unit in scale for unit, scale in zip(row, scales, strict=True)):
            both = zip(units, row, strict=True)
            units = [new if old in ("", new) else f"{old}, {new}" for old, new in both]
            continue
        for unit, scale in zip(units, scales, strict=True):
            if unit not in scale:
                allowed = f"a unit: {', '.join(filter(None, scale))}"
                raise InputError.one(table.path, f"line {table.start}, unit", unit, allowed)
        below = False
        numbers = [number(text, mark) for text in texts]
        if options.is_missing(texts[-1], numbers[-1][0]):
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
        for word, column in words.items():
            read.words[word].append(cells[column] if column < len(cells) else "")
    if not read.rows and not read.faults:
        read.faults.append(Fault(str(table.path), "rows", 0, "at least one row below the header"))


def is_stray(names: Sequence[str], cells: Sequence[str]) -> bool:
    """Whether a cell stands under no heading, as the 5 of 0,5 does. The first column may be an index."""
    return any(cell and not name for name, cell in list(zip_longest(names, cells, fillvalue=""))[1:])


def number(text: str, mark: str) -> tuple[float, str]:
    """The value of a text, NaN if it is no number, and the separator of its thousands.

    mark : the decimal mark, empty if it is not known. The separator is "none" for a number of 1000 or more
    without one, and "" for a smaller number.
    """
    plain, groups = PLAIN.fullmatch(text), GROUPS.fullmatch(text)
    if plain and (plain[1] or plain[2] or mark) == mark:
        value = float(text.replace(mark or ".", "."))
        return value, "none" if abs(value) >= 1000 else ""
    if groups and groups[1] != mark and (groups[2] or mark) == mark and (mark or groups[1] not in OTHER):
        return float(text.replace(groups[1], "").replace(mark or ".", ".")), groups[1]
    return math.nan, ""


def doubt(texts: Iterable[str], mark: str) -> str:
    """What to write instead of the first text with two readings or another decimal mark; "" if none has."""
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
    parts = HEADING.fullmatch(text)
    if not parts or not (name := parts[1] or parts[3] or parts[5]):
        return text, ""
    unit = parts[2] or parts[4] or parts[6] or ""
    return (name if unit in LENGTHS or name in UNITS else text), unit


def parameter(cell: str, names: Iterable[str]) -> str:
    """The one of these names that a heading is, whatever its unit; "" if it is none."""
    words = {name: name.replace("_", r"[\s_-]*") for name in names}
    return next((name for name, word in words.items() if re.fullmatch(word + UNIT, _plain(cell))), "")


def _plain(cell: str) -> str:
    return unicodedata.normalize("NFKC", cell).strip().lower()


def _cells(line: str, delimiter: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:
        return []


def _is_content(line: str) -> bool:
    return bool(line.strip(" ;,\t")) and not line.lstrip().startswith("#")


def _has_number(line: str) -> bool:
    cells = (cell.strip() for cell in _cells(line, _delimiter(line)))
    return any(not math.isnan(number(cell, mark)[0]) for cell in cells for mark in OTHER)


def _delimiter(line: str) -> str:
    return next((mark for mark in ";\t" if mark in line), ",")
