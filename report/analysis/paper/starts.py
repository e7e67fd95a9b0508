"""The starting points on the ten loads of the paper's Table 2."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from harness.results.schema import ANSWERED
from report.analysis.seconds import seconds_text
from report.document.numbers import as_number
from report.results.printed import TABLE_2

from .selection import figures_of, first, ipm

STARTS = {"stp1": "STP1", "stp2": "STP2", "algorithm_5": "Algorithm 5", "mehrotra": "Mehrotra"}
RIVALS = ("stp1", "stp2")
N = 4386


def scene_of(active: int) -> str:
    return f"{N}/{active:04d}"


def loads(cells: pd.DataFrame) -> list[dict[str, Any]]:
    """One record per load of Table 2: iterations, seconds and key of every start, ours and as printed."""
    lines = []
    for active, printed in TABLE_2.items():
        of_scene = cells[cells["scene"] == scene_of(active)]
        reached = of_scene["active"].max()
        line: dict[str, Any] = {"scene": scene_of(active), "active_printed": active, "active": reached}
        for start in STARTS:
            row = first(ipm(of_scene, start=start))
            answered = row is not None and row["verdict"] in ANSWERED
            line[f"{start}_iterations"] = row["iterations"] if row and answered else None
            line[f"{start}_s"] = row["load_case_s"] if row and answered else None
            line[f"{start}_text"] = seconds_text(row) if row else "not measured"
            line[f"{start}_key"] = row["key"] if row else ""
            line[f"{start}_mu"] = figures_of(row, "start").get("mu") if row else None
            line[f"{start}_iterations_printed"], line[f"{start}_s_printed"] = printed.get(start, (None, None))
        lines.append(line)
    return lines


def no_more(line: Mapping[str, Any], suffix: str = "") -> bool | None:
    """Whether Algorithm 5 needed no more iterations than STP1 and STP2; None if a number is missing."""
    mine, *others = [as_number(line[f"{start}_iterations{suffix}"]) for start in ("algorithm_5", *RIVALS)]
    if mine is None or not all(other is not None for other in others):
        return None
    return all(mine <= other for other in others if other is not None)
