"""Nastran's DMIG cards, in small, large and free fields; ten digits are written.

    DMIG  NAME  0   form  type …                    the header
    DMIG  NAME  GJ  CJ    -     G1  C1  A1  -  …    a column: its point and component; the same of each row,
                                                    and the entry

K is symmetric (form 6), A, F and G are rectangular (form 9, columns 1 … m). The unknowns of a scene are
points 1 … n with component 0 (scalar points). Cards hold no zeros, so missing rows are zeros at the points
of K, and a load or gap that is zero everywhere is not written at all. Without K in the file, a matrix must
have all its rows, 1 … r, unless it is square.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.input.entries import from_entries
from problems.input.matrix_files import MIB, Choose
from problems.input.text_files import read_text

OF_PROBLEM = {"F": "f", "G": "g"}
SQUARE, SYMMETRIC, COLUMNS = 1, 6, 9  # forms
REAL = ("1", "2")  # types
WHOLE = re.compile(r"\d+")
NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+))(?:[eEdD]?([-+]\d+)|[eEdD](\d+))?")
Point = tuple[int, int]


@dataclass
class Cards:
    """A matrix: of each entry the points of its row and column, its value, and its line in the file."""

    path: Path
    name: str
    form: int
    line: int
    rows: list[Point] = field(default_factory=list)
    columns: list[Point] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)

    def place(self, k: int) -> str:
        """Of an entry, in a message."""
        return f"{self.name}, {shown(self.rows[k])}, column {shown(self.columns[k])} (line {self.lines[k]})"

    @property
    def points(self) -> list[Point]:
        """The unknowns of a square matrix. Raises InputError for one without an entry on the diagonal."""
        points = sorted({*self.rows, *self.columns})
        diagonal = {a for a, b in zip(self.rows, self.columns, strict=True) if a == b}
        if missing := [point for point in points if point not in diagonal]:
            allowed = "K needs an entry there: is the file cut off?"
            key = f"{self.name}, {shown(missing[0])}, on the diagonal"
            raise InputError.one(self.path, key, None, allowed)
        return points

    def over(self, rows: Sequence[Point], columns: Sequence[Point], what: str) -> sp.csr_array:
        """The entries in these rows and columns. Raises InputError for one that is elsewhere, or twice."""
        places = [{point: k for k, point in enumerate(points)} for points in (rows, columns)]
        for k, (row, column) in enumerate(zip(self.rows, self.columns, strict=True)):
            if row not in places[0] or column not in places[1]:
                raise InputError.one(self.path, self.place(k), self.values[k], f"not among the {what}")
        i = np.array([places[0][row] for row in self.rows], dtype=np.intp)
        j = np.array([places[1][column] for column in self.columns], dtype=np.intp)
        sign = 1 if self.form == SYMMETRIC else None
        shape = len(rows), len(columns)
        return from_entries(self.path, (np.array(self.values), i, j), shape, self.place, sign)


def shown(point: Point) -> str:
    return f"point {point[0]}, component {point[1]}"


def write_dmig(path: Path, data: dict[str, Any]) -> None:
    if data["A"].shape[1] == 0:
        allowed = "at least one: DMIG has no matrix without columns; use another format"
        raise InputError.one(path, "contacts", 0, allowed)
    with path.open("w", encoding="ascii") as file:
        for name, M in {"K": sp.tril(data["K"]), "A": data["A"], "F": data["f"], "G": data["g"]}.items():
            columns = sp.csc_array(M if sp.issparse(M) else M[:, None])
            columns.eliminate_zeros()
            form = SYMMETRIC if name == "K" else COLUMNS
            if columns.nnz:
                file.write(f"DMIG    {name:<8}{0:8}{form:8}{2:8}{0:8}{0:8}{'':8}{columns.shape[1]:8}\n")
            for j in np.flatnonzero(np.diff(columns.indptr)):
                file.write(f"DMIG*   {name:<16}{j + 1:16}{0:16}\n")
                for k in range(columns.indptr[j], columns.indptr[j + 1]):
                    file.write(f"*       {columns.indices[k] + 1:16}{0:16}{_field(columns.data[k])}\n")


def _field(value: float) -> str:
    """Ten digits in 16 characters, of an exponent of three digits without its letter."""
    text = f"{value:16.9E}"
    return text.replace("E", "D") if len(text) == 16 else text.replace("E", "")


def read_dmig(path: Path, choose: Choose) -> dict[str, tuple[Any, np.ndarray | None]]:
    """The chosen matrices, and point and component of the rows of a square one. Raises InputError."""
    cards = _cards(path)
    names = {OF_PROBLEM.get(name, name): matrix for name, matrix in cards.items()}
    return {name: _read(names[name], cards) for name in choose(list(names))}


def _read(one: Cards, cards: dict[str, Cards]) -> tuple[Any, np.ndarray | None]:
    if one.form in (SQUARE, SYMMETRIC) and one.name not in "AFG":
        points = one.points
        return one.over(points, points, "points"), np.array(points, dtype=np.intp).reshape(-1, 2)
    if one.name == "G" and "A" in cards:
        rows, what = _first(max(column for column, _ in cards["A"].columns)), "contacts of A"
    elif "K" in cards:
        rows, what = cards["K"].points, "points of K"
    else:
        rows = _first(len(set(one.rows)))
        what = f"rows 1 … {len(rows)}, as {len(rows)} are present"
    if one.name in ("F", "G") and len(set(one.columns)) != 1:
        raise InputError.one(one.path, f"columns of {one.name}", len(set(one.columns)), "must be 1")
    columns = [one.columns[0]] if one.name in ("F", "G") else _first(max(j for j, _ in one.columns))
    return one.over(rows, columns, f"{what}, or in a column 1 … {len(columns)}"), None


def _first(count: int) -> list[Point]:
    return [(k + 1, 0) for k in range(count)]


def _cards(path: Path) -> dict[str, Cards]:
    """The matrices of a file by their names, in capitals. Raises InputError."""
    cards: list[list[tuple[int, str]]] = []
    for line, begins, words in _lines(read_text(path, "file", MIB)):
        if begins:
            cards.append([])
        cards[-1] += [(line, word) for word in words]
    matrices: dict[str, Cards] = {}
    for (line, name), at, second, third, *rest in cards:
        name = name.upper()
        if at[1] == "0":
            if name in matrices:
                twice = f"also in line {matrices[name].line}: each matrix needs a name to itself"
                raise InputError.one(path, f"line {line}, a header of", name, twice)
            if rest and third[1] not in REAL:
                raise InputError.one(path, f"line {line}, type of {name}", third[1], "1 or 2, real numbers")
            matrices[name] = Cards(path, name, int(_match(path, second, WHOLE)[0]), line)
            continue
        if name not in matrices:
            raise InputError.one(path, f"line {line}, a column of", name, "comes before its header")
        column, matrix = (_whole(path, at), _whole(path, second)), matrices[name]
        for k in range(0, len(rest) - 3, 4):
            row, component, value, imaginary = rest[k : k + 4]
            if imaginary[1]:
                raise InputError.one(path, f"line {line}", imaginary[1], "no fourth number of a real entry")
            if row[1] or value[1]:
                matrix.rows.append((_whole(path, row), _whole(path, component)))
                matrix.columns.append(column)
                matrix.values.append(_number(path, value))
                matrix.lines.append(row[0])
    return {name: matrix for name, matrix in matrices.items() if matrix.rows}


def _lines(text: str) -> Iterator[tuple[int, bool, list[str]]]:
    """Of each line of the cards its number, whether it begins one, and its fields, 8, or 4 large ones."""
    inside = False
    for number, line in enumerate(text.split("\n"), start=1):
        line = line.partition("$")[0].expandtabs().rstrip()
        if not line:
            continue
        words = line.split(",") if "," in line else [line[:8]]
        begins = words[0].strip().upper() in ("DMIG", "DMIG*")
        inside = begins or (inside and line[0] in " +*,")
        if inside:
            count = 4 if "*" in words[0] else 8
            if len(words) == 1:
                words += [line[k : k + 64 // count] for k in range(8, 72, 64 // count)]
            words = [word.strip() for word in words[1 : 1 + count]]
            yield number, begins, words + [""] * (count - len(words))


def _whole(path: Path, at: tuple[int, str]) -> int:
    return int(_match(path, at, WHOLE)[0]) if at[1] else 0


def _number(path: Path, at: tuple[int, str]) -> float:
    digits, signed, exponent = _match(path, at, NUMBER).groups()
    return float(f"{digits}e{signed or exponent or 0}")


def _match(path: Path, at: tuple[int, str], pattern: re.Pattern[str]) -> re.Match[str]:
    line, word = at
    if match := pattern.fullmatch(word):
        return match
    raise InputError.one(path, f"line {line}", word, "a number in each field of the card")
