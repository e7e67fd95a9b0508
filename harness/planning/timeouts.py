"""Which measurements would run out of time for certain, by the rows there are, and are not worth making."""

from __future__ import annotations

from harness.results.records import Row
from problems.scene import read_scene

from .plan import Measurement

#: The statuses of a measurement that ran out of its time, or was not started because it would have.
OUT_OF_TIME = ("time_limit", "not_run")


def out_of_time_before(m: Measurement, n: int, rows: list[Row]) -> str:
    """The scenes that show that m would run out of time, or "".

    One is m's own, where the solver ran out of as much time at this tolerance or a looser one. Else they
    are all those of the next smaller size n' that the same solver, form and settings were measured
    on, if it ran out of its time T' on each, and the time T that m has is at most (n/n')² T': every
    solver here works with dense matrices, so its time grows with n² at least. (Not so on the rungs of
    ladders, where it is not size that makes them hard.)
    """
    same = ("solver", "form", "variant", "options", "threads_asked")
    mine = (m.solver, m.form, m.variant, m.options, m.threads)
    own = [row for row in rows if tuple(row[name] for name in same) == mine]
    looser = [row for row in own if row["scene"] == m.scene and row["tolerance"] >= m.tolerance]
    for row in looser:
        if row["status"] in OUT_OF_TIME and m.time_limit_s <= row["time_limit_s"]:
            return f"{m.scene} at {row['tolerance']:g}"
    if read_scene(m.source).on_ladder:
        return ""
    smaller = [row for row in own if row["n"] < n and row["tolerance"] == m.tolerance]
    largest = max((row["n"] for row in smaller), default=0)
    there = [row for row in smaller if row["n"] == largest]
    growth = (n / largest) ** 2 if largest else 0.0
    late = [
        row
        for row in there
        if row["status"] in OUT_OF_TIME and m.time_limit_s <= growth * row["time_limit_s"]
    ]
    return ", ".join(sorted({row["scene"] for row in late})) if len(late) == len(there) else ""
