"""Tables of lines under their keys: numbers to three digits, in the CSV file to all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import pandas as pd

from report.document.blocks import Column, Table
from report.document.numbers import as_number, significant

LARGE = 1e5  # numbers from here on have a power of ten


def table(name: str, caption: str, lines: Sequence[Mapping[str, Any]], keys: int = 1) -> Table:
    """keys : the columns that a table repeats where it continues below."""
    frame = pd.DataFrame(lines, dtype=object)
    texts = {key: all(isinstance(cell, str) for cell in frame[key]) for key in lines[0]}
    columns = [Column(key, partial(_shown, key=key), "left" if texts[key] else "right") for key in lines[0]]
    return Table(name, caption, frame, columns, keys)


def _shown(line: Mapping[str, Any], key: str) -> str:
    cell = line[key]
    if isinstance(cell, str):
        return cell.replace("|", r"\|")
    number = as_number(cell)
    whole = number is not None and number.is_integer() and abs(number) < LARGE
    return f"{number:.0f}" if whole else significant(number)
