"""Tables of gaps as CSV: one row per case, one column per contact, by the rules of problems/input/tables.py.

A header has no number, or counts the contacts from 0 or 1 in whole numbers; titles above it are skipped.
Other whole numbers in the first line, or large ones below a header, are refused: they may be names of nodes,
or parts of decimal numbers. A first column that counts its rows, or whose heading says so, is left out.
"""

import re
from collections.abc import Sequence
from itertools import chain, islice
from math import isnan
from pathlib import Path

import numpy as np

from problems.errors import InputError
from problems.forms.assembly import Matrix, Vector
from problems.input.tables import AS_NAMED, LENGTHS, NO_UNIT, Cells, TableOptions, doubt, heading, number

COUNTS = {"", "case", "name", "index", "row", "no", "no.", "nr", "nr.", "id", "unnamed: 0"}
PLAUSIBLE = 5  # mm: gaps before riveting are smaller
FIRST = 20  # rows that tell whether the first line is a header
NOTHING = re.compile(r"#\D.*|n/?a|nan|null|-*", re.IGNORECASE)  # where a gap is not measured
QUICK = re.compile(r"[-+.\deE]+", re.ASCII)


def read_gaps(
    path: Path, m: int, mib: float, options: TableOptions = AS_NAMED, labels: Sequence[int] = ()
) -> Matrix:
    """(rows, columns) mm, NaN where a gap is missing; labels : the contacts' nodes. Raises InputError."""
    table = Cells.of(path, mib, ())
    rows = table.rows()
    first = list(islice(rows, FIRST))
    names = _header(path, first, m, labels)
    unit = LENGTHS[_unit(path, names[-m:])]
    mark, values = table.decimal_mark(range(2 * m + 2)), []
    for line, row in chain(first, rows):
        cells = _trimmed(row, m)
        values.append(_numbers(path, line, cells, mark, m, options))
        if len(cells) < len(names) or len(cells) != len(values[0]):
            allowed = f"{max(len(values[0]), len(names))} cells, as in the first row"
            raise InputError.one(path, f"line {line}, cells", len(cells), allowed)
    gaps = np.array(values).reshape(len(values), -1) if values else np.empty((0, 0))
    if gaps.shape[1] == m + 1:
        counting = len(gaps) > 1 and (np.diff(gaps[:, 0]) == 1).all() and not gaps[0, 0] % 1
        if counting or (len(names) == m + 1 and names[0].lower() in COUNTS):
            gaps = gaps[:, 1:]
    return gaps * unit.numerator / unit.denominator


def _trimmed(cells: list[str], m: int) -> list[str]:
    """The cells without empty ones at the end, but m of them."""
    while len(cells) > m and not cells[-1]:
        cells = cells[:-1]
    return cells


def _header(path: Path, rows: list[tuple[int, list[str]]], m: int, labels: Sequence[int]) -> list[str]:
    """The header, taken from the first rows with a row of units below it, which is added to the names."""
    names: list[str] = []
    while len(rows) > 1 and rows[0][1][0].startswith("# ") and not any(map(_is_number, rows[1][1])):
        del rows[0]
    while rows and not names and not any(map(_is_number, rows[0][1][-m:])):
        if all(NOTHING.fullmatch(cell) for cell in rows[0][1][-m:]):
            return []
        cells = [cell.lstrip("# ") for cell in _trimmed(rows.pop(0)[1], m)]
        names = cells if len(cells) >= m else []
    units = [cell.strip("[]() ").lower() for cell in rows[0][1]] if names and rows else []
    if {*units} - NO_UNIT.keys() and LENGTHS.keys() >= {*units}:
        del rows[0]
        names = [f"{cell} [{unit}]" for cell, unit in zip(names, units, strict=False)]
    numbers = [int(digits[-1]) for name in names[-m:] if (digits := re.findall(r"\d+", name))]
    counts = [list(range(m)), list(range(1, m + 1))]
    orders = [*counts, list(labels)]
    if numbers not in orders and sorted(numbers) in map(sorted, orders):
        like = next(order for order in orders if sorted(order) == sorted(numbers))
        allowed = f"columns of the contacts {like[0]} to {like[-1]} in this order"
        raise InputError.one(path, "header", ", ".join(names), allowed)
    line, cells = (rows[0][0], _trimmed(rows[0][1], m)) if rows else (0, [])
    values = [number(cell, ".")[0] for cell in cells[-m:]]
    whole = len(values) == m and all(cell.isascii() and cell.isdigit() for cell in cells[-m:])
    counting = m > 2 and not names and values in counts
    fractions = any({*cell} & {*".,"} for _, row in rows[1:] for cell in row)
    if counting and whole and fractions:
        del rows[0]
        return cells
    if counting or (whole and (not names or (fractions and max(values) > PLAUSIBLE))):
        allowed = "a header or gaps? Delete a header; write one of letters above gaps, with decimal marks"
        raise InputError.one(path, f"line {line}", ", ".join(cells[:5]), allowed)
    return names


def _is_number(cell: str) -> bool:
    return not all(isnan(number(cell, mark)[0]) for mark in ".,")


def _unit(path: Path, names: list[str]) -> str:
    """The unit of the contacts' headings; a unit alone is a name, unless all headings are units.

    Raises InputError if they have several units, or one that is no length.
    """
    alone = all(name.lower() in LENGTHS for name in names)
    units = sorted({name.lower() if alone else heading(name)[1] for name in names})
    if len({LENGTHS.get(unit, unit) for unit in units}) > 1 or not LENGTHS.keys() >= {*units}:
        allowed = f"one unit of length for all contacts: {', '.join(filter(None, LENGTHS))}"
        raise InputError.one(path, "header, unit", ", ".join(units), allowed)
    return units[0] if units else ""


def _numbers(path: Path, line: int, cells: list[str], mark: str, m: int, options: TableOptions) -> Vector:
    """The numbers of a row, NaN where one is missing. Raises InputError if one of the last m is none."""
    if mark == "." and not options.missing and QUICK.fullmatch("".join(cells)):
        try:
            return np.array(list(map(float, cells)))
        except ValueError:
            pass
    values = np.array([number(cell, mark)[0] for cell in cells])
    lost = np.array([*map(options.is_missing, cells, values)])
    wrong = doubt((cell for cell, is_lost in zip(cells, lost, strict=True) if not is_lost), mark)
    if wrong or (np.isnan(values) & ~lost)[-m:].any():
        allowed = wrong or "a finite number in each cell"
        raise InputError.one(path, f"line {line}", ", ".join(cells)[:80], allowed)
    return np.where(lost, np.nan, values)
