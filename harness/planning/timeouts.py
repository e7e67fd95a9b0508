"""Measurements predicted, from the rows so far, to exceed their time limit: these are skipped."""

from __future__ import annotations

from harness.results.records import Row
from problems.forms.names import DENSE_FORMS
from problems.scene import read_scene

from .plan import Measurement

#: The statuses of a measurement that ran out of its time, or was not started because it would have.
OUT_OF_TIME = ("time_limit", "not_run")


def predicted_timeout(m: Measurement, n: int, rows: list[Row]) -> str:
    """The scenes that show that m would exceed its time limit, or "".

    The scene of m itself, if the solver exceeded at least the same limit there at this tolerance or a looser
    one. Else all scenes of the next smaller size n' on which the same solver, form and settings were
    measured, if it exceeded its limit T' on each and the limit of m is at most (n/n')² T', or (n/n') T' in
    the sparse form: with dense matrices, time grows at least like n², with sparse ones like n. (Not on rungs
    of ladders, where size is not what makes them hard.)
    """
    own = [row for row in rows if m.same_settings(row)]
    looser = [row for row in own if row["scene"] == m.scene and row["tolerance"] >= m.tolerance]
    for row in looser:
        if row["status"] in OUT_OF_TIME and m.time_limit_s <= row["time_limit_s"]:
            return f"{m.scene} at {row['tolerance']:g}"
    if read_scene(m.source).on_ladder:
        return ""
    smaller = [row for row in own if row["n"] < n and row["tolerance"] == m.tolerance]
    largest = max((row["n"] for row in smaller), default=0)
    comparable = [row for row in smaller if row["n"] == largest]
    growth = (n / largest) ** (2 if m.form in DENSE_FORMS else 1) if largest else 0.0
    timed_out = [
        row
        for row in comparable
        if row["status"] in OUT_OF_TIME and m.time_limit_s <= growth * row["time_limit_s"]
    ]
    return ", ".join(sorted({row["scene"] for row in timed_out})) if len(timed_out) == len(comparable) else ""
