"""Nastran's DMIG cards, in small, large and free fields; ten digits are written.

    DMIG  NAME  0   form  type …                    the header
    DMIG  NAME  GJ  CJ    -     G1  C1  A1  -  …    a column: its point and component; the same of each row,
                                                    and the entry

K is symmetric (form 6), A, F and G are rectangular (form 9, columns 1 … m). The unknowns of a scene are
points 1 … n with component 0 (scalar points). Cards hold no zeros, so missing rows are zeros at the points
of K, and a load or gap that is zero everywhere is not written at all. Without K in the file, a matrix must
have all its rows, 1 … r, unless it is square.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.input.matrix_entries import from_entries
from problems.input.matrix_files import LARGEST_MIB, Choose
from problems.input.text_files import read_text

OF_PROBLEM = {"F": "f", "G": "g"}
SQUARE, RECTANGULAR, SYMMETRIC, COLUMNS = 1, 2, 6, 9  # forms
REAL = (1, 2)  # types
WHOLE = re.compile(r"(\d+)")
NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+))(?:[eEdD]?([-+]\d+)|[eEdD](\d+))?")
INCLUDE = re.compile(r"(?mi)^[ \t]*include\b.*$")
SCALED = re.compile(r"(?mi)^[ \t]*(?:dmigrot\b|param\*?[ \t,]+ck2\b).*$")  # factors of DMIG
#: Lines by which the matrix is not what the cards say, and what is allowed.
REFUSED = {
    INCLUDE: "is not followed: give the file that holds the cards",
    SCALED: "is not applied: multiply or turn the entries by it, and leave it out",
}
Point = tuple[int, int]


@dataclass
class Cards:
    """The cards of a matrix: form, line of the header, and the row, column, value and line of each entry."""

    form: int
    line: int
    entries: list[tuple[Point, Point, float, int]] = field(default_factory=list)

    @property
    def points(self) -> list[Point]:
        """The points of the rows and columns of a square matrix."""
        return sorted({point for row, column, *_ in self.entries for point in (row, column)})


def write_dmig(path: Path, data: dict[str, Any]) -> None:
    if data["A"].shape[1] == 0:
        allowed = "at least one: DMIG has no matrix without columns; use another format"
        raise InputError.one(path, "contacts", 0, allowed)
    with path.open("w", encoding="ascii") as file:
        for name, M in {"K": sp.tril(data["K"]), "A": data["A"], "F": data["f"], "G": data["g"]}.items():
            columns = sp.csc_array(M if sp.issparse(M) else M[:, None], copy=True)
            columns.eliminate_zeros()
            form = SYMMETRIC if name == "K" else COLUMNS
            if columns.nnz:
                file.write(f"DMIG    {name:<8}{0:8}{form:8}{2:8}{0:8}{0:8}{'':8}{columns.shape[1]:8}\n")
            for j in np.flatnonzero(np.diff(columns.indptr)):
                file.write(f"DMIG*   {name:<16}{j + 1:16}{0:16}\n")
                for k in range(columns.indptr[j], columns.indptr[j + 1]):
                    file.write(f"*       {columns.indices[k] + 1:16}{0:16}{_field(columns.data[k])}\n")


def _field(value: float) -> str:
    """A number with ten digits in 16 characters; an exponent of three digits has no letter."""
    text = f"{value:16.9E}"
    return text.replace("E", "D") if len(text) == 16 else text.replace("E", "")


def read_dmig(path: Path, choose: Choose) -> dict[str, tuple[Any, np.ndarray | None]]:
    """Read the chosen matrices, with the points and components of a square one. Raises InputError."""
    cards = _cards(path)
    names = {OF_PROBLEM.get(name, name): name for name in cards}
    return {name: _read(path, names[name], cards) for name in choose(list(names))}


def _read(path: Path, name: str, cards: dict[str, Cards]) -> tuple[Any, np.ndarray | None]:
    form, entries = cards[name].form, cards[name].entries
    if form in (SQUARE, SYMMETRIC) and name not in ("A", *OF_PROBLEM):
        points = cards[name].points
        labels = np.array(points, dtype=np.intp)
        return _over(path, name, cards[name], points, points, "points"), labels
    if name == "G" and "A" in cards:
        rows, what = _columns(path, "A", cards), "contacts of A"
    elif "K" in cards:
        rows, what = cards["K"].points, "points of K"
    else:
        rows = _first(len({row for row, *_ in entries}))
        what = f"rows 1 … {len(rows)}, as {len(rows)} are present"
    columns = sorted({column for _, column, *_ in entries})
    if name in OF_PROBLEM and len(columns) > 1:
        raise InputError.one(path, f"columns of {name}", len(columns), "must be 1")
    if name not in OF_PROBLEM:
        columns = _columns(path, name, cards)
    what = f"{what}, or of columns 1 … {len(columns)}"
    return _over(path, name, cards[name], rows, columns, what), None


def _first(count: int) -> list[Point]:
    return [(k + 1, 0) for k in range(count)]


def _columns(path: Path, name: str, cards: dict[str, Cards]) -> list[Point]:
    """The columns 1 … m of a rectangular matrix. Raises InputError if one of them has no entry."""
    columns = {column for _, (column, _), *_ in cards[name].entries}
    if len(columns) < (last := max(columns)):
        missing = next(k for k in range(1, last) if k not in columns)
        raise InputError.one(path, f"{name}, column {missing}", None, f"columns 1 … {last}, none left out")
    return _first(last)


def _over(
    path: Path, name: str, cards: Cards, rows: Sequence[Point], columns: Sequence[Point], what: str
) -> sp.csr_array:
    """The matrix over these rows and columns. Raises InputError for an entry elsewhere, or listed twice."""

    def place(k: int) -> str:
        (a, b), (c, d), _, line = cards.entries[k]
        return f"{name}, point {a}, component {b}, column point {c}, component {d} (line {line})"

    of_row, of_column = ({point: k for k, point in enumerate(points)} for points in (rows, columns))
    for k, (row, column, value, _) in enumerate(cards.entries):
        if row not in of_row or column not in of_column:
            raise InputError.one(path, place(k), value, f"not among the {what}")
    i = np.array([of_row[row] for row, *_ in cards.entries], dtype=np.intp)
    j = np.array([of_column[column] for _, column, *_ in cards.entries], dtype=np.intp)
    values = np.array([value for *_, value, _ in cards.entries])
    sign = 1 if cards.form == SYMMETRIC else None
    return from_entries(path, (values, i, j), (len(rows), len(columns)), place, sign)


def _cards(path: Path) -> dict[str, Cards]:
    """The matrices of a file by their names, in capitals. Raises InputError."""
    matrices: dict[str, Cards] = {}
    text = read_text(path, "file", LARGEST_MIB)
    for pattern, allowed in REFUSED.items():
        if found := pattern.search(text):
            line = text.count("\n", 0, found.start()) + 1
            raise InputError.one(path, f"line {line}", found[0], allowed)
    for (line, name), *fields in _fields(path, text):
        name = name.upper()
        point, component, third, *rest = fields
        if point[1] == "0":
            if name in matrices:
                twice = f"also in line {matrices[name].line}: each matrix needs a name to itself"
                raise InputError.one(path, f"line {line}, a header of", name, twice)
            form, kind = _whole(path, component), _whole(path, third)
            if form not in (SQUARE, RECTANGULAR, SYMMETRIC, COLUMNS) or kind not in REAL:
                allowed = "a form of 1, 2, 6 or 9, and a type of 1 or 2: real numbers"
                raise InputError.one(path, f"line {line}, form and type of {name}", (form, kind), allowed)
            matrices[name] = Cards(form, line)
            continue
        if name not in matrices:
            raise InputError.one(path, f"line {line}, a column of", name, "comes before its header")
        column = _whole(path, point), _whole(path, component, blank="0")
        for k in range(0, len(rest) - 3, 4):
            row, component, value, imaginary = rest[k : k + 4]
            if imaginary[1]:
                raise InputError.one(path, f"line {line}", imaginary[1], "no fourth number of a real entry")
            if row[1] or value[1]:
                at = _whole(path, row), _whole(path, component, blank="0")
                digits, signed, exponent = _match(path, value, NUMBER)
                number = float(f"{digits}e{signed or exponent or 0}")
                matrices[name].entries.append((at, column, number, row[0]))
    return {name: matrix for name, matrix in matrices.items() if matrix.entries}


def _fields(path: Path, text: str) -> Iterator[list[tuple[int, str]]]:
    """Yield the fields of each card after its own name, with the numbers of their lines.

    Raises InputError for a line with more fields than a card has, and one that continues none.
    """
    card: list[tuple[int, str]] = []
    inside = False
    for number, line in enumerate(text.split("\n"), start=1):
        line = line.partition("$")[0].expandtabs().rstrip()
        if not line:
            continue
        words = line.split(",") if "," in line else [line[:8]]
        first = words[0].strip().upper()
        begins = first in ("DMIG", "DMIG*")
        inside = begins or (inside and line[0] in " +*," and not first[:1].isalpha())
        if not inside:
            continue
        if not begins and first[:1] not in ("", "+", "*"):
            allowed = "a continuation, whose first field is blank or begins with + or *"
            raise InputError.one(path, f"line {number}", line, allowed)
        count = 4 if "*" in words[0] else 8
        if len(words) == 1:
            words += [line[k : k + 64 // count] for k in range(8, 72, 64 // count)]
        words, more = [[word.strip() for word in part] for part in (words[1 : 1 + count], words[2 + count :])]
        if any(more):
            allowed = f"at most {count} fields and one for the continuation; the rest in a line of its own"
            raise InputError.one(path, f"line {number}", line, allowed)
        if begins and card:
            yield card
            card = []
        card += [(number, word) for word in words + [""] * (count - len(words))]
    if card:
        yield card


def _whole(path: Path, at: tuple[int, str], blank: str = "") -> int:
    line, word = at
    return int(_match(path, (line, word or blank), WHOLE)[0] or 0)


def _match(path: Path, at: tuple[int, str], pattern: re.Pattern[str]) -> Sequence[str | None]:
    line, word = at
    if match := pattern.fullmatch(word):
        return match.groups()
    raise InputError.one(path, f"line {line}", word, "a number in each field of the card")
