"""Which measurement is due, as the rows so far show.

tolerances = "auto" searches, in decades, the loosest tolerance whose answer is within the limit on the scene,
from the one found before; repeats = "auto" repeats what is quick: five times what takes under 2 s, three
times what takes under 20 s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf

from harness.results.records import Row
from harness.results.schema import STEPS

from .plan import DECADES, MOST_REPEATS, Measurement
from .timeouts import OUT_OF_TIME

#: (seconds of the first run below which, repeats).
REPEATS = ((2.0, MOST_REPEATS), (20.0, 3), (inf, 1))


def due(m: Measurement, rows: Sequence[Row]) -> Measurement | None:
    """What to measure in m's place in the plan: of a search, its next tolerance. None if nothing."""
    if not (m.searched or m.paced):
        return m
    own = [row for row in rows if row["scene"] == m.scene and m.same_settings(row)]
    first = [row for row in own if row["repeat"] == 0 and row["tolerance"] in DECADES]
    if m.searched and m.repeat == 0:
        tolerance = _next(first, _start(m, rows))
        return None if tolerance is None else replace(m, tolerance=tolerance)
    if m.searched and found(first) != m.tolerance and _next(first, DECADES[0]) is None:
        return None
    same = [row for row in own if row["repeat"] == 0 and row["tolerance"] == m.tolerance]
    return None if m.paced and any(m.repeat >= _repeats(row) for row in same) else m


def found(rows: Sequence[Row]) -> float | None:
    """The loosest tolerance whose answer is within the limit."""
    return max((row["tolerance"] for row in rows if row["verdict"] == "within"), default=None)


def _start(m: Measurement, rows: Sequence[Row]) -> float:
    """The tolerance found last for this solver in this form, on another scene or by another variant; else the
    loosest.
    """
    own = [row for row in rows if (row["solver"], row["form"]) == (m.solver, m.form)]
    before = [row for row in own if row["verdict"] == "within" and row["tolerance"] in DECADES]
    if not before:
        return DECADES[0]
    scene, variant = (before[-1][name] for name in ("scene", "variant"))
    return max(row["tolerance"] for row in before if (row["scene"], row["variant"]) == (scene, variant))


def _next(tried: Sequence[Row], start: float) -> float | None:
    """One decade looser than what is within the limit; one tighter than answers that are solved and outside;
    one looser than what was not solved. None if that was tried, if there is no such decade, or after running
    out of time twice.
    """
    if not tried:
        return start
    if len(tried) > 1 and all(row["status"] in OUT_OF_TIME for row in tried):
        return None
    place, step = _place(tried)
    candidate = place + step
    known = {row["tolerance"] for row in tried}
    if not 0 <= candidate < len(DECADES) or DECADES[candidate] in known:
        return None
    return DECADES[candidate]


def _place(tried: Sequence[Row]) -> tuple[int, int]:
    """The decade, as an index, from which the search goes on, and where to: 1 tighter, −1 looser."""
    loosest = found(tried)
    if loosest is not None:
        return DECADES.index(loosest), -1
    outside = [row["tolerance"] for row in tried if row["status"] == "solved"]
    if outside:
        return DECADES.index(min(outside)), 1
    return DECADES.index(max(row["tolerance"] for row in tried)), -1


def _repeats(row: Row) -> int:
    seconds = sum(row[name] or 0.0 for name in STEPS)
    return next(repeats for limit, repeats in REPEATS if seconds < limit)
