"""What the rows say of sections 5.3 and 5.4: the linear systems and the starting points."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from report.document.numbers import power, span

from .rows import SYSTEMS, ByScene, Evidence, Study, against, clearly_faster, counts, merged, pairs
from .tables import RIVALS, STARTS, iterations, loads

# The thresholds that claims.csv states.
RATIO, HUNDREDS, LATE = 20, 100, 40  # CG iterations
FEW, SAME, FEASIBLE_MM, LOADS = 0.01, 1e-6, 1e-7, 8

ORDERINGS = ("V = U + √D", "V = U + √D, open gaps last")


# Linear systems.


def cg_from_thousands_to_few(study: Study) -> Evidence:
    for ordering in ORDERINGS:
        V = study.ipm(**SYSTEMS[ordering])
        for scene, row in study.ipm(**SYSTEMS["V = I"]).items():
            none, few = counts(row), counts(V.get(scene))
            if none and few:
                reached = none.total >= RATIO * few.total
                known = not (few.cut if reached else none.cut)
                holds = reached and none.largest >= HUNDREDS if known else None
                yield f"{ordering}, {scene}", holds, f"{none} / {few}"


def few_cg_to_the_end(study: Study) -> Evidence:
    for ordering in ORDERINGS:
        rows = study.ipm(**SYSTEMS[ordering]).values()
        for n in dict.fromkeys(row["n"] for row in rows):
            late = [found.late for row in rows if row["n"] == n and (found := counts(row))]
            if late:
                yield f"{ordering}, n = {n:.0f}", max(late) <= LATE, str(max(late))


def u_needs_more_cg_than_v(study: Study) -> Evidence:
    V = study.ipm()
    for scene, row in study.ipm(**SYSTEMS["U alone"]).items():
        with_d, without = counts(V.get(scene)), counts(row)
        if with_d and without:
            more = without.total > with_d.total
            known = not (with_d.cut if more else without.cut)
            yield scene, more if known else None, f"U {without}, V {with_d}"


def faster_than(rival: str, mine: Iterable[str] = ORDERINGS) -> Callable[[Study], Evidence]:
    """Evidence that V, in each ordering of `mine`, is faster than another of SYSTEMS."""

    def evidence(study: Study) -> Evidence:
        for name in mine:
            for a, b in pairs(study.ipm(**SYSTEMS[name]), study.ipm(**SYSTEMS[rival])):
                yield f"{name}, {a['scene']}", clearly_faster(a, b), against(a, b)

    return evidence


# Starting points.


def _starts(study: Study, start: str = "algorithm_5") -> ByScene:
    """The details of each row on its start, with m."""
    rows = study.ipm(start=start).items()
    return {scene: about | {"m": r["m"]} for scene, r in rows if (about := r["details"].get("start"))}


def no_correction(study: Study) -> Evidence:
    if found := [about["corrections"] == 0 for about in _starts(study).values()]:
        yield "none", all(found), f"on {sum(found)} of {len(found)} scenes"


def few_corrections(study: Study) -> Evidence:
    if found := [about["corrections"] / about["m"] for about in _starts(study).values()]:
        yield "at most", max(found) <= FEW, f"{max(found):.1%} of m"


def only_algorithm_5_is_feasible(study: Study) -> Evidence:
    for start in ("algorithm_5", *RIVALS):
        if found := [about["infeasibility_mm"] for about in _starts(study, start).values()]:
            holds = max(found) <= FEASIBLE_MM if start == "algorithm_5" else min(found) > FEASIBLE_MM
            yield STARTS[start], holds, f"{span(power(min(found)), power(max(found)))} mm"


def algorithms_4_and_5_agree(study: Study) -> Evidence:
    of_5 = _starts(study)
    for scene, four in _starts(study, "algorithm_4").items():
        if five := of_5.get(scene):
            apart = abs(four["mu"] - five["mu"]) / five["mu"]
            equal = all(four[name] == five[name] for name in ("corrections", "multiplications"))
            yield scene, equal and apart <= SAME, f"μ₀ {power(apart, 2)} apart (relative)"


def fewer_iterations(study: Study) -> Evidence:
    """A case per load, or a single one if it holds on LOADS."""
    compared = []
    for active, rows in loads(study).items():
        mine, *others = (iterations(rows.get(start)) for start in ("algorithm_5", *RIVALS))
        if mine is not None and None not in others:
            holds = all(mine <= other for other in others if other is not None)
            compared.append((f"{active} active", holds, f"{mine} against {' and '.join(map(str, others))}"))
    met = sum(holds for _, holds, _ in compared)
    yield from compared if met < LOADS else [("no more", True, f"on {met} of {len(compared)} loads")]


def start_saves_time(study: Study) -> Evidence:
    for rival in RIVALS:
        both = pairs(study.ipm(), study.ipm(start=rival))
        if both := [(a, b) for a, b in both if not (a["cut"] or b["cut"])]:
            mine, other = (merged(rows, sum) for rows in zip(*both, strict=True))
            yield f"{STARTS[rival]}, {len(both)} scenes", clearly_faster(mine, other), against(mine, other)
