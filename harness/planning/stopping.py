"""A solver that is left far behind is stopped: a loss by more needs no figure."""

from __future__ import annotations

from collections.abc import Sequence

from harness.results.records import Row
from harness.results.schema import STEPS

from .plan import Measurement

LEAST_S = 10.0


def stopped_at(m: Measurement, rows: Sequence[Row]) -> tuple[float, str]:
    """The time limit of m, s, and why it is tighter than the suite's; "" if it is not.

    max(10 s, k × the seconds of the fastest library other than m's within the limit on m's scene), by the
    first of its repeats, with k = `stop_at_times_fastest` of the suite.
    """
    others = [
        (sum(row[step] or 0.0 for step in STEPS), f"{row['solver']} {row['form']}")
        for row in rows
        if row["scene"] == m.scene and row["owner"] == "library" and row["solver"] != m.solver
        if row["verdict"] == "within" and row["repeat"] == 0
    ]
    if m.stop_at_times_fastest is None or not others:
        return m.time_limit_s, ""
    seconds, name = min(others)
    limit_s = max(LEAST_S, m.stop_at_times_fastest * seconds)
    if limit_s >= m.time_limit_s:
        return m.time_limit_s, ""
    return limit_s, f"{m.stop_at_times_fastest:g} × {name} ({seconds:.2g} s), at least {LEAST_S:g} s"
