"""A comparison of runs for the page."""

from __future__ import annotations

from typing import Any

import pandas as pd

from report.analysis.checks import commits_text
from report.document.blocks import records
from report.document.numbers import listed

from .banner import banner
from .packed import Data

#: name, heading, whether it is a number
COLUMNS = [
    ("measurement", "measurement", False),
    ("change", "change", False),
    ("verdict_old", "verdict before", False),
    ("verdict_new", "after", False),
    ("error_mm_old", "error before, mm", True),
    ("error_mm_new", "after, mm", True),
    ("digits_lost", "digits lost", True),
    ("iterations_old", "iterations before", True),
    ("iterations_new", "after", True),
    ("seconds_old", "seconds before", True),
    ("seconds_new", "after", True),
    ("ratio", "ratio of times", True),
    ("ratio_least", "at least", True),
    ("ratio_most", "at most", True),
    ("status_old", "status before", False),
    ("status_new", "after", False),
]


def comparison_data(pairs: list[tuple[str, str, str, pd.DataFrame]], rows: pd.DataFrame) -> Data:
    """What the page of a comparison shows. pairs : old, new, summary, and the table of each; rows : of all
    runs, with their `side`.
    """
    return {
        "kind": "compare",
        "banner": _banner(rows),
        "columns": [list(column) for column in COLUMNS],
        "comparisons": [
            {"old": old, "new": new, "summary": summary, "lines": [_line(line) for line in records(table)]}
            for old, new, summary, table in pairs
        ],
    }


def _banner(rows: pd.DataFrame) -> Data:
    sides = [(str(side), of_side) for side, of_side in rows.groupby("side", sort=False)]
    changed = [side for side, of_side in sides if (of_side["clean"] == 0).any()]
    warned = [f"Rows of {listed(changed)} were measured with uncommitted changes."] if changed else []
    if rows["machine"].nunique() > 1:
        warned.append("The rows come from several machines; times are compared within one machine only.")
    code = "; ".join(f"{side}: {commits_text(of_side)}" for side, of_side in sides)
    return banner(rows, commits=code, counts=f"{len(rows)} rows", warnings=warned)


def _line(line: dict[str, Any]) -> Data:
    names = ["group", *(name for name, *_ in COLUMNS)]
    return {name: None if pd.isna(line[name]) else line[name] for name in names}
