"""Decides which measurements are still worth running, from the rows measured so far.

tolerances = "auto" searches for the loosest tolerance whose answer is within the limit on the scene.
repeats = "auto" repeats what is quick. times_best_form = k measures a library in all its forms on the first
scene of the smallest size; on the first scene of each other size in those that took at most k times as long
as its best on the first scene of the next smaller size; on the other scenes in the best of the first, if that
took at most a tenth of the time limit.
"""

from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import replace
from math import inf, sqrt

from harness.results.records import Row
from harness.results.schema import STEPS

from .plan import HALF_DECADES, MOST_REPEATS, Measurement

#: (seconds of the first run below which, repeats).
REPEATS = ((2.0, MOST_REPEATS), (20.0, 3))
EXCEEDED = ("time_limit", "memory_limit")
START = 1e-6  # of a search, where the solver has no rows in the form
DECADE = 2  # places in HALF_DECADES
LITTLE = sqrt(10)  # times the limit: an error that half a decade may mend


def unmeasured(plan: Sequence[Measurement], rows: Sequence[Row]) -> list[Measurement]:
    """The measurements of a plan that need a row and have none."""
    done, of_solver = {row["key"] for row in rows}, by_solver(rows)
    return [m for m in plan if m.key not in done and still_needed(m, of_solver[m.solver]) is not None]


def by_solver(rows: Sequence[Row]) -> defaultdict[str, list[Row]]:
    """The rows of each solver. Those of a measurement's solver are all that decides on it."""
    found: defaultdict[str, list[Row]] = defaultdict(list)
    for row in rows:
        found[str(row.get("solver"))].append(row)
    return found


def still_needed(m: Measurement, rows: Sequence[Row]) -> Measurement | None:
    """The measurement in m's place in the plan, at the next tolerance of a search; None if there is none.

    rows : those of m's solver, perhaps among others, which only take time.
    """
    if m.guide is None and m.iteration_limit is None and not (m.searched or m.paced):
        return m
    if not in_a_good_form(m, rows):
        return None
    if m.iteration_limit is not None:
        same = [
            row for row in _of_cell(replace(m, iteration_limit=None), rows) if row["tolerance"] == m.tolerance
        ]
        return None if any((row.get("iterations") or 0) <= m.iteration_limit for row in same) else m
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


#: A scene, a form or None for any, a solver, its label and threads.
Cell = tuple[str, str | None, str, str, int]


def cell_of(m: Measurement) -> Cell:
    return m.scene, m.form, m.solver, m.entry.label, m.threads


def decided_by(m: Measurement) -> set[Cell]:
    """The cells whose rows `still_needed` asks for: it cannot tell while one of them is being measured."""
    cells = set[Cell]()
    if m.searched or m.paced or m.iteration_limit is not None:
        cells.add(cell_of(m))
    if m.guide:
        cells.add((m.guide[0], None, *cell_of(m)[2:]))
    return cells


def decides_on(m: Measurement) -> set[Cell]:
    """The cells of m whose rows may decide on others: none of a repeat, or of a run that a trace stops."""
    if m.repeat or m.iteration_limit is not None:
        return set()
    return {cell_of(m), (m.scene, None, *cell_of(m)[2:])}


def in_a_good_form(m: Measurement, rows: Sequence[Row]) -> bool:
    """Whether m's form was good enough on the scene that guides m, or nothing is known of it there."""
    if m.guide is None:
        return True
    scene, times, most_s = m.guide
    seconds: dict[str, float] = {}
    for row in rows:
        there = row["scene"] == scene and row.get("owner") == "library"
        if there and m.same_settings(row | {"form": m.form}):
            own = _seconds(row) if row["verdict"] == "within" else inf
            seconds[row["form"]] = min(own, seconds.get(row["form"], inf))
    best = min(seconds.values(), default=inf)
    if most_s < best < inf:
        return False
    return not seconds or (m.form in seconds and seconds[m.form] <= times * best)


def next_tolerance(m: Measurement, rows: Sequence[Row]) -> float | None:
    """The next of the tolerances tried for m's solver in its form on m's scene, or None at the end.

    The first is the decade tried last on another scene, with these settings if there is such a row. A
    decade at which the solver gave no answer is followed by the next looser one; one that was solved and
    missed the limit by the next tighter one. One that sufficed is followed by a looser one, in steps of 1,
    2, 4, … decades, or half-way to the next that did not suffice where the step would pass it. Between one
    that misses by little and one that suffices, half a decade is tried. The search ends where all these
    were tried or do not exist, and where all tolerances tried exceeded a limit: two of them, or a single
    one after a search on another scene.
    """
    same = [row for row in rows if (row["solver"], row["form"]) == (m.solver, m.form) and not row["repeat"]]
    searched = [row for row in same if row["tolerance"] in HALF_DECADES]
    own = _of_cell(m, searched)  # perhaps several of a tolerance, as workers once made them
    tried = {HALF_DECADES.index(row["tolerance"]): row for row in own}
    if not tried:
        decades = [row for row in searched if row["tolerance"] in HALF_DECADES[::DECADE]]
        decades = [row for row in decades if m.same_settings(row)] or decades
        return float(decades[-1]["tolerance"]) if decades else START
    enough = 2 if len(own) == len(searched) else 1
    if len(tried) >= enough and all(row["status"] in EXCEEDED for row in tried.values()):
        return None
    within = [k for k, row in tried.items() if row["verdict"] == "within"]
    missed = [k for k, row in tried.items() if row["status"] == "solved" and k not in within]
    if not within:
        k = max(missed) + DECADE if missed else min(tried) - DECADE
    elif min(within) % DECADE:
        return None
    else:
        k = _looser(min(within), len(within), tried)
        looser = tried.get(k, {})
        if looser and (looser.get("displacement_error_mm") or inf) <= LITTLE * looser["limit_mm"]:
            k += 1
    return HALF_DECADES[k] if k in range(len(HALF_DECADES)) and k not in tried else None


def _looser(enough: int, times: int, tried: Collection[int]) -> int:
    """The place of the decade to try after the loosest that sufficed, the last of so many that did."""
    missed = max((k for k in tried if k < enough), default=-DECADE)
    k = enough - DECADE * 2 ** (times - 1)
    return k if k > missed else missed + (enough - missed) // DECADE // 2 * DECADE


def _of_cell(m: Measurement, rows: Sequence[Row]) -> list[Row]:
    """The rows of m's solver with the same settings on m's scene."""
    return [row for row in rows if row["scene"] == m.scene and m.same_settings(row)]


def _repeats(row: Row) -> int:
    return next((repeats for limit, repeats in REPEATS if _seconds(row) < limit), 1)


def _seconds(row: Row) -> float:
    """The seconds of all steps; infinite where the solver did not end."""
    return inf if row.get("solve_s") is None else sum(row.get(name) or 0.0 for name in STEPS)
