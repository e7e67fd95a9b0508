"""Measurements that need not be made, as the rows so far show.

tolerances = "auto" searches, in decades, the loosest tolerance whose answer is within the limit on the scene;
repeats = "auto" repeats what is quick: five times what takes under 2 s, three times what takes under 20 s.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from harness.results.records import Row
from harness.results.schema import STEPS

from .plan import DECADES, MOST_REPEATS, Measurement

#: (seconds of the first run below which, repeats).
REPEATS = ((2.0, MOST_REPEATS), (20.0, 3), (inf, 1))


def superfluous(m: Measurement, rows: Sequence[Row]) -> bool:
    """Whether the search at looser tolerances has ended, or m was repeated often enough."""
    if not (m.searched or m.paced):
        return False
    first = [row for row in rows if row["repeat"] == 0 and row["scene"] == m.scene and m.same_settings(row)]
    if m.searched and not _due(m, first):
        return True
    same = [row for row in first if row["tolerance"] == m.tolerance]
    return m.paced and any(m.repeat >= _repeats(row) for row in same)


def _due(m: Measurement, first: Sequence[Row]) -> bool:
    """first : the rows of the search. It ends with a tolerance that the solver did not reach, or whose answer
    is within the limit; only the latter is repeated.
    """
    if m.repeat:
        return not _ended(first) or found(first) == m.tolerance
    looser = [row for row in first if row["tolerance"] > m.tolerance]
    return not _ended(looser)


def _ended(first: Sequence[Row]) -> bool:
    return any(
        row["verdict"] == "within" or row["status"] != "solved" or row["tolerance"] == DECADES[-1]
        for row in first
    )


def found(rows: Sequence[Row]) -> float | None:
    """The loosest tolerance whose answer is within the limit."""
    return max((row["tolerance"] for row in rows if row["verdict"] == "within"), default=None)


def _repeats(row: Row) -> int:
    seconds = sum(row[name] or 0.0 for name in STEPS)
    return next(repeats for limit, repeats in REPEATS if seconds < limit)
