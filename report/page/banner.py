"""The banner of a page: machine, code and dates, with a warning for each reason to doubt them."""

from __future__ import annotations

import pandas as pd

from report.analysis.checks import commits_text

from .packed import Data


def banner(rows: pd.DataFrame, **more: object) -> Data:
    """rows : with `machine`, `commit`, `clean` and `recorded_at`. more : `counts`, `versions`, `warnings`, or
    other words for any of the banner's lines.
    """
    rows = rows.assign(clean=rows["clean"].astype(float))  # true, false or not known
    times = sorted(time for time in rows["recorded_at"] if time)
    lines = {
        "machines": [name or "not recorded" for name in rows["machine"].unique()],
        "commits": commits_text(rows) if len(rows) else "",
        "measured": " to ".join(dict.fromkeys([_minute(times[0]), _minute(times[-1])])) if times else "",
        "versions": [],
        "counts": "",
        "warnings": [],
    }
    return lines | more


def _minute(time: str) -> str:
    return f"{time[:16].replace('T', ' ')} UTC"
