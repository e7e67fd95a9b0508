"""Tables of gaps as CSV: one row per case, one column per contact, by the rules of problems/input/tables.py.

A first line is a header if it has no number, or if it counts: three or more whole numbers without a decimal
mark, each one more than the one before. Other whole numbers, all different, may be names of nodes: they are
refused above rows with decimal marks. A first column that counts its rows, or whose heading says so, is left
out.
"""

from __future__ import annotations

import re
from itertools import chain, islice
from math import isnan
from pathlib import Path

import numpy as np

from problems.errors import InputError
from problems.forms.assembly import Matrix, Vector
from problems.input.tables import LENGTHS, Cells, doubt, heading, number

COUNTS = {"", "case", "index", "row", "no", "no.", "nr", "nr.", "id", "unnamed: 0"}
PLAUSIBLE = 5  # mm: gaps before riveting are smaller
FIRST = 20  # rows that tell whether the first line is a header
QUICK = re.compile(r"[-+.\deE]+", re.ASCII)


def read_gaps(path: Path, m: int, mib: float) -> Matrix:
    """(rows, columns) mm, NaN where a cell is no number. Raises InputError."""
    table = Cells.of(path, mib, ())
    rows = table.rows()
    first = list(islice(rows, FIRST))
    names = _header(path, first, m)
    unit = LENGTHS[_unit(path, names)]
    mark, ends = table.decimal_mark(range(2 * m + 2)), True
    values = []
    for line, cells in chain(first, rows):
        values.append(_numbers(path, line, cells, mark))
        ends = ends and not cells[-1]
        if len(cells) != len(values[0]):
            allowed = f"{len(values[0])} cells, as in the first row"
            raise InputError.one(path, f"line {line}, cells", len(cells), allowed)
    gaps = np.array(values).reshape(len(values), -1) if values else np.empty((0, 0))
    if ends and gaps.shape[1] > m:
        gaps = gaps[:, :-1]
    if gaps.shape[1] == m + 1:
        counting = len(gaps) > 1 and (np.diff(gaps[:, 0]) == 1).all() and not gaps[0, 0] % 1
        if counting or (len(names) == m + 1 and names[0].lower() in COUNTS):
            gaps = gaps[:, 1:]
    return gaps * unit.numerator / unit.denominator


def _header(path: Path, rows: list[tuple[int, list[str]]], m: int) -> list[str]:
    """The header, taken from the first rows with a row of units below it, which is added to the names."""
    if not rows:
        return []
    line, cells = rows[0]
    while len(cells) > m and not cells[-1]:
        cells = cells[:-1]
    labels, others = cells[-m:], [cell for _, row in rows[1:] for cell in row]
    if all(isnan(number(label, mark)[0]) for label in labels for mark in ".,"):
        del rows[0]
        if rows and all(text.strip("[]() ").lower() in LENGTHS for text in rows[0][1]) and any(rows[0][1]):
            _, units = rows.pop(0)
            return [f"{cell} [{unit.strip('[]() ')}]" for cell, unit in zip(cells, units, strict=False)]
        return cells
    if (
        len(labels) < m
        or not all(label.isascii() and label.isdigit() for label in labels)
        or len({*labels}) < len(labels)
    ):
        return []
    numbers, fractions = [int(label) for label in labels], any("." in cell or "," in cell for cell in others)
    counts = numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    if counts and len(numbers) > 2:
        del rows[0]
        return cells
    if others and (fractions or max(numbers) > PLAUSIBLE):
        allowed = "a header or gaps? Delete a header; write gaps with a decimal mark, as 1.0"
        raise InputError.one(path, f"line {line}", ", ".join(labels[:5]), allowed)
    return []


def _unit(path: Path, names: list[str]) -> str:
    """The unit of the headings. Raises InputError if they have several, or one that is no length."""
    names = [f"gap [{name}]" if name.lower() in LENGTHS else name for name in names]
    units = sorted({heading(name)[1] for name in names} - {"", "-"})
    if len(units) > 1 or any(unit not in LENGTHS for unit in units):
        allowed = f"one unit of length: {', '.join(filter(None, LENGTHS))}"
        raise InputError.one(path, "header, unit", ", ".join(units), allowed)
    return units[0] if units else ""


def _numbers(path: Path, line: int, cells: list[str], mark: str) -> Vector:
    if mark == "." and QUICK.fullmatch("".join(cells)):
        try:
            return np.array(list(map(float, cells)))
        except ValueError:
            pass
    if wrong := doubt(cells, mark):
        raise InputError.one(path, f"line {line}", ", ".join(cells)[:80], wrong)
    return np.array([number(cell, mark)[0] for cell in cells])
