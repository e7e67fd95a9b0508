"""What of a plan is measured, and for how long, as the rows so far show.

tolerances = "auto" searches, in decades, the loosest tolerance whose answer is within the limit on the scene,
from the one found before. A looser one that missed on two scenes of the size, and sufficed on none, is not
tried again. repeats = "auto" repeats what is quick: five times what takes under 2 s, three times what takes
under 20 s. What is predicted to exceed its time limit is skipped. What is left far behind is stopped: a loss
by more needs no figure. What was behind by less on two scenes of a size is measured on these alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf

from harness.results.records import Row
from harness.results.schema import STEPS
from problems.forms import DENSE_FORMS
from problems.ladders import LADDERS, prefix_of

from .plan import DECADES, MOST_REPEATS, Measurement

#: (seconds of the first run below which, repeats).
REPEATS = ((2.0, MOST_REPEATS), (20.0, 3), (inf, 1))
#: The statuses of a measurement that ran out of its time, or was not started because it would have.
OUT_OF_TIME = ("time_limit", "not_run")
FEWEST_SCENES = 2  # of a size, that predict another one of it
START = 1e-6  # of a search from nothing
TIMES_BEHIND = 3.0  # the fastest library: what takes longer on FEWEST_SCENES scenes is not run on others
TIMES_BEST_FORM = 3.0  # of a solver's seconds in its best form, after which another form of it is stopped
TELLING_S = 1.0  # at a smaller size: what is quicker is largely constant, and does not grow
LEAST_S = 10.0  # before what is left behind is stopped


def due(m: Measurement, rows: Sequence[Row]) -> Measurement | None:
    """What to measure in m's place in the plan: of a search, its next tolerance. None if nothing."""
    if not (m.searched or m.paced):
        return m
    own = [row for row in rows if row["scene"] == m.scene and m.same_settings(row)]
    first = [row for row in own if row["repeat"] == 0 and row["tolerance"] in DECADES]
    if m.searched and (m.repeat == 0 or found(first) != m.tolerance):
        elsewhere = [row for row in rows if row["scene"] != m.scene or not m.same_settings(row)]
        tolerance = _next(first, _before(m, elsewhere), _missed(m, rows))
        if m.repeat == 0:
            return None if tolerance is None else replace(m, tolerance=tolerance)
        if tolerance is None:
            return None
    same = [row for row in own if row["repeat"] == 0 and row["tolerance"] == m.tolerance]
    return None if m.paced and any(m.repeat >= _repeats(row) for row in same) else m


def found(rows: Sequence[Row]) -> float | None:
    """The loosest tolerance whose answer is within the limit."""
    return max((row["tolerance"] for row in rows if row["verdict"] == "within"), default=None)


def _before(m: Measurement, rows: Sequence[Row]) -> float | None:
    """The tolerance found last for this solver in this form, on another scene or by another variant; if none
    was, the tightest that missed, or else the loosest that was tried.
    """
    own = [row for row in rows if (row["solver"], row["form"]) == (m.solver, m.form)]
    tried = [row for row in own if row["tolerance"] in DECADES]
    before = [row for row in tried if row["verdict"] == "within"]
    if not before:
        missed = [row["tolerance"] for row in tried if row["status"] == "solved"]
        return min(missed) if missed else max((row["tolerance"] for row in tried), default=None)
    scene, variant = (before[-1][name] for name in ("scene", "variant"))
    return max(row["tolerance"] for row in before if (row["scene"], row["variant"]) == (scene, variant))


def _missed(m: Measurement, rows: Sequence[Row]) -> set[float]:
    """The tolerances that missed on FEWEST_SCENES other scenes of the size of m's, and sufficed on none."""
    n = next((row["n"] for row in rows if row["scene"] == m.scene), None)
    others = [row for row in rows if row["n"] == n and row["scene"] != m.scene and m.same_settings(row)]
    scenes: dict[float, set[str]] = {}
    for row in others:
        if row["status"] == "solved" and row["verdict"] == "outside":
            scenes.setdefault(row["tolerance"], set()).add(row["scene"])
    sufficed = {row["tolerance"] for row in others if row["verdict"] == "within"}
    return {tolerance for tolerance, on in scenes.items() if len(on) >= FEWEST_SCENES} - sufficed


def _next(tried: Sequence[Row], before: float | None, missed: set[float]) -> float | None:
    """Where to look next for a tolerance t that suffices, and 10 t that misses here or is in `missed`.

    From one that suffices 1, 2, 4, … decades looser, from one that is solved and misses as many tighter, and
    once both are known between them; one looser than what was not solved. None if that was tried, if there is
    no such decade, or after running out of time: once from `before`, else twice.
    """
    if not tried:
        return before or START
    if all(row["status"] in OUT_OF_TIME for row in tried) and (before is not None or len(tried) > 1):
        return None
    places = {DECADES.index(row["tolerance"]): row for row in tried}
    within = [k for k, row in places.items() if row["verdict"] == "within"]
    outside = [k for k, row in places.items() if row["status"] == "solved" and k not in within]
    if within:
        k = min(within)
        looser = [j for j in (*outside, *map(DECADES.index, missed)) if j < k]
        candidate = (k + max(looser)) // 2 if looser else max(k - 2 ** (len(within) - 1), 0)
        known = {*places, *looser}
    elif outside:
        k = max(outside)
        tighter = [j for j in places if j > k]
        candidate = (k + min(tighter)) // 2 if tighter else min(k + 2 ** (len(outside) - 1), len(DECADES) - 1)
        known = {*places}
    else:
        candidate, known = min(places) - 1, {*places}
    return None if candidate < 0 or candidate in known else DECADES[candidate]


def _repeats(row: Row) -> int:
    seconds = _seconds(row)
    return next(repeats for limit, repeats in REPEATS if seconds < limit)


def _seconds(row: Row) -> float:
    """Of all steps."""
    return sum(row.get(name) or 0.0 for name in STEPS)


def stopped_at(m: Measurement, rows: Sequence[Row]) -> tuple[float, str]:
    """The time limit of m, s, and why it is tighter than the suite's; "" if it is not.

    max(10 s, min(k × the seconds of the fastest library other than m's, 3 × those of m's solver with the
    same settings in its best other form)) of the answers within the limit on m's scene, by the first of their
    repeats, with k = `stop_at_times_fastest` of the suite.
    """
    k, limits = m.stop_at_times_fastest, []
    if k is None:
        return m.time_limit_s, ""
    for row in rows:
        if row["scene"] == m.scene and row["verdict"] == "within" and row["repeat"] == 0:
            own = row["solver"] == m.solver
            another = row["form"] != m.form and row["variant"] == m.variant
            if another if own else row["owner"] == "library":
                times = TIMES_BEST_FORM if own else k
                limits.append((times * _seconds(row), times, f"{row['solver']} {row['form']}"))
    if not limits:
        return m.time_limit_s, ""
    seconds, times, name = min(limits)
    limit_s = max(LEAST_S, seconds)
    if limit_s >= m.time_limit_s:
        return m.time_limit_s, ""
    return limit_s, f"{times:g} × {name} ({seconds / times:.2g} s), at least {LEAST_S:g} s"


def predicted_timeout(m: Measurement, n: int, rows: list[Row]) -> str:
    """The scenes that show that m would exceed its time limit, or "".

    The scene of m itself, if the solver exceeded at least the same limit there at this tolerance or a looser
    one. Else all scenes of the next smaller size n' on which the same solver, form and settings were
    measured, if its seconds there, or the limit that they exceeded, times (n/n')² are beyond the limit of m,
    or times n/n' in the sparse form: with dense matrices, time grows at least like n², with sparse ones like
    n, beyond a constant: less than TELLING_S tells nothing. (Not on rungs of ladders, where size is not what
    makes them hard.) Or else the other scenes of the size of m, if it was left behind on two or more of
    them, or on one and on all of n', and on none was not.
    """
    own = [row for row in rows if m.same_settings(row)]
    looser = [row for row in own if row["scene"] == m.scene and row["tolerance"] >= m.tolerance]
    for row in looser:
        if row["status"] in OUT_OF_TIME and m.time_limit_s <= row["time_limit_s"]:
            return f"{m.scene} at {row['tolerance']:g}"
    if prefix_of(m.source) in LADDERS:
        return ""
    smaller = [row for row in own if row["n"] < n]
    alike = _of_largest([row for row in smaller if row["tolerance"] == m.tolerance])
    growth = [(n / row["n"]) ** (2 if m.form in DENSE_FORMS else 1) for row in alike]
    late = [_least(row) >= max(TELLING_S, m.time_limit_s / g) for g, row in zip(growth, alike, strict=True)]
    if alike and all(late):
        return _listed(alike)
    if m.stop_at_times_fastest is None:
        return ""
    same = [row for row in own if row["n"] == n and row["scene"] != m.scene]
    before = _of_largest(smaller)
    if _lost(same, rows, 1) and _lost(before, rows, FEWEST_SCENES):
        return _listed([*same, *before])
    return _listed(same) if _lost(same, rows, FEWEST_SCENES) else ""


def _of_largest(rows: Sequence[Row]) -> list[Row]:
    """Those of the largest size."""
    largest = max((row["n"] for row in rows), default=0)
    return [row for row in rows if row["n"] == largest]


def _lost(cells: Sequence[Row], rows: Sequence[Row], fewest: int) -> bool:
    """Whether some cells were left behind on all their scenes, and on so many."""
    scenes = {row["scene"] for row in cells}
    behind = (_behind([row for row in cells if row["scene"] == scene], rows) for scene in scenes)
    return len(scenes) >= fewest and all(behind)


def _behind(cell: Sequence[Row], rows: Sequence[Row]) -> bool:
    """Whether a cell took more than max(10 s, 3 × the fastest library other than its own) on its scene: the
    fastest of its answers within the limit, if there are any; or more than its memory limit.
    """
    first = cell[0]
    others = [
        _seconds(row)
        for row in rows
        if row["scene"] == first["scene"] and row["owner"] == "library" and row["solver"] != first["solver"]
        if row["verdict"] == "within"
    ]
    within = [row for row in cell if row["verdict"] == "within"]
    return bool(others) and min(map(_least, within or cell)) >= max(LEAST_S, TIMES_BEHIND * min(others))


def _least(row: Row) -> float:
    """Seconds, or the limit that was not enough; infinite if the memory was not."""
    if row["status"] == "memory_limit":
        return inf
    return float(row["time_limit_s"]) if row["status"] in OUT_OF_TIME else _seconds(row)


def _listed(rows: Sequence[Row]) -> str:
    return ", ".join(sorted({row["scene"] for row in rows}))
