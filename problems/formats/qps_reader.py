"""Reads quadratic MPS, fields between blanks. What it does not understand is an error.

I. Maros and Cs. Mészáros, Optim. Methods Softw. 11:671–681 (1999). QUADOBJ holds one triangle of P, QMATRIX
all of it. An unknown without a bound has x ≥ 0; readers disagree about a negative UP alone: an error, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import inf, isfinite
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from problems.errors import InputError
from problems.formats import Data

from .rows_and_bounds import contact_problem

INTERVAL = {"L": (-inf, 0.0), "G": (0.0, inf), "E": (0.0, 0.0)}
UNBOUNDED = {"FR": (-inf, inf), "MI": (-inf, None), "PL": (None, inf)}
INTEGER = ("BV", "LI", "UI", "SC")
LONGEST_LINE = 60  # characters quoted in a message
SECTIONS = ("ROWS", "COLUMNS", "RHS", "RANGES", "BOUNDS", "QUADOBJ", "QMATRIX")

Entry = tuple[int, int]


@dataclass
class _Program:
    """Numbers of rows and unknowns by their names, and the entries; row −1 is the objective's."""

    objective: str = ""
    rows: dict[str, int] = field(default_factory=dict)
    others: set[str] = field(default_factory=set)  # free rows after the objective, which count for nothing
    kinds: list[str] = field(default_factory=list)
    columns: dict[str, int] = field(default_factory=dict)
    entries: dict[Entry, float] = field(default_factory=dict)
    quadratic: dict[Entry, float] = field(default_factory=dict)
    triangle: bool = True
    sides: dict[int, float] = field(default_factory=dict)
    ranges: dict[int, float] = field(default_factory=dict)
    lower: dict[int, float] = field(default_factory=dict)
    upper: dict[int, float] = field(default_factory=dict)

    def row(self, name: str) -> int | None:
        if name in self.others:
            return None
        return -1 if name == self.objective else _known(self.rows, name, "row")


def read(path: Path) -> Data:
    """K, A, f, g. Raises InputError, naming the line, or for what is no contact problem."""
    program, section, ended = _Program(), "", False
    for number, line in enumerate(path.read_text("utf-8").splitlines(), start=1):
        words = line.split()
        if ended or not words or line.startswith("*"):
            continue
        try:
            if line[0].isspace():
                _take(program, section, words)
            else:
                section, ended = words[0], words[0] == "ENDATA"
                _begin(program, words)
        except ValueError as error:
            raise InputError.one(path, f"line {number}", line.strip()[:LONGEST_LINE], str(error)) from error
    if not ended:
        raise InputError.one(path, "ENDATA", None, "is missing: the file is truncated")
    return _as_contacts(path, program)


def _begin(program: _Program, words: list[str]) -> None:
    if words[0] not in ("NAME", "OBJSENSE", "ENDATA", *SECTIONS):
        raise ValueError(f"an unknown section; one of {', '.join(SECTIONS)}")
    if words[0] in SECTIONS and len(words) > 1:
        raise ValueError("a section's name stands alone")
    if words[0] == "QMATRIX":
        program.triangle = False
    if words[0] == "OBJSENSE" and words[1:]:
        _minimise(words[1])


def _minimise(sense: str) -> None:
    if sense not in ("MIN", "MINIMIZE"):
        raise ValueError("contact problems are minima")


def _take(program: _Program, section: str, words: list[str]) -> None:
    """One line of a section."""
    match section:
        case "OBJSENSE":
            _minimise(words[0])
        case "ROWS":
            _row(program, *_fields(words, 2))
        case "COLUMNS":
            if "'MARKER'" in words:
                raise ValueError("contact problems have real unknowns only")
            j = program.columns.setdefault(words[0], len(program.columns))
            for name, value in _pairs(words[1:]):
                _put_once(program.entries, program.row(name), value, j)
        case "RHS" | "RANGES":
            found = program.sides if section == "RHS" else program.ranges
            for name, value in _pairs(words[len(words) % 2 :]):
                row = program.row(name)
                if row in found:
                    raise ValueError(f"a second value for {name}")
                if row is not None:
                    found[row] = value
        case "BOUNDS":
            _bound(program, words)
        case "QUADOBJ" | "QMATRIX":
            for name, value in _pairs(words[1:]):
                at = [_known(program.columns, each, "unknown") for each in (words[0], name)]
                column, row = sorted(at) if program.triangle else at
                _put_once(program.quadratic, row, value, column)
        case _:
            raise ValueError("a line before the first section")


def _row(program: _Program, kind: str, name: str) -> None:
    if name in program.rows or name in program.others or name == program.objective:
        raise ValueError(f"a second row {name}")
    if kind in INTERVAL:
        program.rows[name] = len(program.rows)
        program.kinds.append(kind)
    elif kind != "N":
        raise ValueError("a row is N, L, G or E")
    elif program.objective:
        program.others.add(name)
    else:
        program.objective = name


def _bound(program: _Program, words: list[str]) -> None:
    kind = words[0]
    if kind in INTEGER:
        raise ValueError("contact problems have real unknowns only")
    valued = kind in ("LO", "UP", "FX")
    if not valued and kind not in UNBOUNDED:
        raise ValueError("a bound is LO, UP, FX, FR, MI or PL")
    # The name of the set of bounds may be missing; FR, MI and PL may have a value that means nothing.
    name = words[-2] if valued or len(words) == 4 else words[-1]
    if len(words) not in ((3, 4) if valued else (2, 3, 4)):
        raise ValueError("a bound has its kind, a set's name, the unknown, and a value")
    j = _known(program.columns, name, "unknown")
    value = _number(words[-1]) if valued else 0.0
    low, high = UNBOUNDED.get(kind, (value if kind != "UP" else None, value if kind != "LO" else None))
    for side, bound in ((program.lower, low), (program.upper, high)):
        if bound is None:
            continue
        if j in side:
            raise ValueError(f"a second bound on the same side of {name}")
        side[j] = bound


def _as_contacts(path: Path, program: _Program) -> Data:
    size, count = len(program.columns), len(program.rows)
    for name, j in program.columns.items():
        if program.upper.get(j, inf) < 0 and j not in program.lower:
            allowed = "an upper bound below zero needs a lower one, if only MI"
            raise InputError.one(path, f"bounds of {name}", program.upper[j], allowed)
    intervals = [INTERVAL[kind] for kind in program.kinds]
    sides = np.array([program.sides.get(row, 0.0) for row in range(count)])
    lower, upper = (np.array([interval[k] for interval in intervals]) + sides for k in (0, 1))
    for row, width in program.ranges.items():
        if program.kinds[row] == "L" or (program.kinds[row] == "E" and width < 0):
            lower[row] = upper[row] - abs(width)
        else:
            upper[row] = lower[row] + abs(width)
    lows = [program.lower.get(j, 0.0) for j in range(size)]
    highs = [program.upper.get(j, inf) for j in range(size)]
    rows = sp.vstack([_matrix(program.entries, count, size), sp.eye_array(size)])
    q = np.array([program.entries.get((-1, j), 0.0) for j in range(size)])
    P = _matrix(program.quadratic, size, size)
    P = P + sp.tril(P, -1).T if program.triangle else P
    return contact_problem(path, P, q, rows, np.append(lower, lows), np.append(upper, highs))


def _matrix(entries: dict[Entry, float], rows: int, columns: int) -> sp.csr_array:
    kept = {at: value for at, value in entries.items() if at[0] >= 0}
    at = np.array(list(kept), dtype=int).reshape(-1, 2).T
    return sp.csr_array((np.array(list(kept.values())), (at[0], at[1])), shape=(rows, columns))


def _put_once(entries: dict[Entry, float], row: int | None, value: float, column: int) -> None:
    if row is None:
        return
    if (row, column) in entries:
        raise ValueError("a second value for the same entry")
    entries[row, column] = value


def _known(numbers: dict[str, int], name: str, what: str) -> int:
    if name not in numbers:
        raise ValueError(f"{name} is no {what} of the file")
    return numbers[name]


def _fields(words: list[str], count: int) -> list[str]:
    if len(words) != count:
        raise ValueError(f"{count} fields, and no blanks in names")
    return words


def _pairs(words: list[str]) -> Iterator[tuple[str, float]]:
    if not words or len(words) % 2:
        raise ValueError("names, each with a number, and no blanks in names")
    yield from zip(words[::2], map(_number, words[1::2]), strict=True)


def _number(word: str) -> float:
    if "_" in word or not isfinite(value := float(word)):
        raise ValueError(f"{word} is no finite number")
    return value
