"""A comparison of runs for the page."""

from __future__ import annotations

from typing import Any

import pandas as pd

from report.analysis.comparison import ADDED, BETTER, CHANGED, SAME, WORSE
from report.document.blocks import records

from .answer import banner
from .packed import Data

GROUPS = {
    **dict.fromkeys(WORSE, "worse"),
    CHANGED: "another status",
    BETTER: "better",
    ADDED: "new",
    SAME: "alike",
}
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


def comparison_data(pairs: list[tuple[str, str, str, pd.DataFrame]]) -> Data:
    """What the page of a comparison shows. pairs : old, new, summary, and the table of each."""
    names = sorted({side for old, new, *_ in pairs for side in (old, new)})
    return {
        "kind": "compare",
        "banner": banner([" / ".join(names)]),
        "columns": [list(column) for column in COLUMNS],
        "comparisons": [
            {"old": old, "new": new, "summary": summary, "lines": [_line(line) for line in records(table)]}
            for old, new, summary, table in pairs
        ],
    }


def _line(line: dict[str, Any]) -> Data:
    shown = {name: line.get(name) for name, *_ in COLUMNS}
    return {name: None if pd.isna(value) else value for name, value in shown.items()} | {
        "group": GROUPS[line["kind"]]
    }
