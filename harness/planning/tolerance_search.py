"""Decides which measurements are still worth running, and for how long, from the rows measured so far.

tolerances = "auto" searches, decade by decade, for the loosest tolerance whose answer is within the limit on
the scene. repeats = "auto" repeats what is quick. stop_at_times_fastest = k stops what takes k times as long
as the fastest other library, and does not run what was stopped on two scenes of a size on the others.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import inf

from harness.results.records import Row
from harness.results.schema import STEPS

from .plan import DECADES, MOST_REPEATS, Measurement

#: (seconds of the first run below which, repeats).
REPEATS = ((2.0, MOST_REPEATS), (20.0, 3), (inf, 1))
#: The statuses of a measurement that ran out of its time, or was not started because it would have; and of
#: one that exceeded a limit.
OUT_OF_TIME = ("time_limit", "not_run")
EXCEEDED = (*OUT_OF_TIME, "memory_limit")
START = 1e-6  # of a search, where the solver has no rows in the form
LEAST_S = 10.0  # before a measurement is stopped by `stop_at_times_fastest`


def still_needed(m: Measurement, rows: Sequence[Row]) -> Measurement | None:
    """The measurement in m's place in the plan, at the next tolerance of a search; None if there is none."""
    first = [row for row in _of_cell(m, rows) if row["repeat"] == 0]
    if m.searched:
        tolerance = next_tolerance(m, rows)
        if m.repeat == 0:
            return None if tolerance is None else replace(m, tolerance=tolerance)
        within = [row["tolerance"] for row in first if row["verdict"] == "within"]
        if tolerance is None and m.tolerance != max(within, default=None):
            return None
    if m.paced and any(m.repeat >= _repeats(row) for row in first if row["tolerance"] == m.tolerance):
        return None
    return m


def next_tolerance(m: Measurement, rows: Sequence[Row]) -> float | None:
    """The next of the tolerances tried for m's solver in its form on m's scene, or None at the end.

    The first is the one tried last on another scene or by another variant. A tolerance that sufficed, or at
    which the solver gave no answer, is followed by the next looser one; one that was solved and missed the
    limit by the next tighter one. The search ends where that one was tried or does not exist, and where all
    tolerances tried exceeded a limit: two of them, or a single one after a search on another scene.
    """
    same = [row for row in rows if (row["solver"], row["form"]) == (m.solver, m.form) and not row["repeat"]]
    searched = [row for row in same if row["tolerance"] in DECADES]
    tried = {DECADES.index(row["tolerance"]): row for row in _of_cell(m, searched)}
    if not tried:
        return float(searched[-1]["tolerance"]) if searched else START
    enough = 2 if len(tried) == len(searched) else 1
    if len(tried) >= enough and all(row["status"] in EXCEEDED for row in tried.values()):
        return None
    within = [k for k, row in tried.items() if row["verdict"] == "within"]
    missed = [k for k, row in tried.items() if row["status"] == "solved" and k not in within]
    k = min(within) - 1 if within else max(missed) + 1 if missed else min(tried) - 1
    return DECADES[k] if k in range(len(DECADES)) and k not in tried else None


def time_limit(m: Measurement, rows: Sequence[Row]) -> tuple[float, str]:
    """The time limit of m, s, and why it is tighter than the suite's; "" if it is not.

    max(10 s, k × the seconds of the fastest library other than m's that is within the limit on m's scene),
    with k = `stop_at_times_fastest` of the suite.
    """
    others = [
        (_seconds(row), f"{row['solver']} {row['form']}")
        for row in rows
        if row["scene"] == m.scene and row["verdict"] == "within" and row["repeat"] == 0
        if row["owner"] == "library" and row["solver"] != m.solver
    ]
    times = m.suite.stop_at_times_fastest
    if times is None or not others:
        return m.time_limit_s, ""
    fastest, name = min(others)
    limit_s = max(LEAST_S, times * fastest)
    if limit_s >= m.time_limit_s:
        return m.time_limit_s, ""
    return limit_s, f"{times:g} × {name} ({fastest:.2g} s), at least {LEAST_S:g} s"


def exceeded_on(m: Measurement, n: int, rows: Sequence[Row]) -> str:
    """The scenes on which m's solver exceeded its limits, so that m is not run; "" if it is run.

    That is m's own scene, if the solver ran out of at least m's time there at m's tolerance or a looser one.
    In a suite with `stop_at_times_fastest` it is also two other scenes of n unknowns, if the time or the
    memory ran out at each tolerance on all such scenes.
    """
    for row in _of_cell(m, rows):
        late = row["status"] in OUT_OF_TIME and row["time_limit_s"] >= m.time_limit_s
        if late and row["tolerance"] >= m.tolerance:
            return f"{m.scene} at {row['tolerance']:g}"
    others = [row for row in rows if m.same_settings(row) and row["n"] == n and row["scene"] != m.scene]
    scenes = sorted({row["scene"] for row in others})
    exceeded = all(row["status"] in EXCEEDED for row in others)
    return ", ".join(scenes) if m.suite.stop_at_times_fastest and exceeded and len(scenes) > 1 else ""


def _of_cell(m: Measurement, rows: Sequence[Row]) -> list[Row]:
    """The rows of m's solver with the same settings on m's scene."""
    return [row for row in rows if row["scene"] == m.scene and m.same_settings(row)]


def _repeats(row: Row) -> int:
    return next(repeats for limit, repeats in REPEATS if _seconds(row) < limit)


def _seconds(row: Row) -> float:
    """The seconds of all steps."""
    return sum(row.get(name) or 0.0 for name in STEPS)
