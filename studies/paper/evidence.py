"""What the rows say of each claim: for each case (a scene, a size, a form …) whether it holds there, None if
the rows leave that open, and the figures that decide it.

The time of a stopped run is a lower bound, and decides only what a lower bound can decide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from report.analysis.standings import TIE
from report.document.numbers import power, significant, span, whole

from . import table3
from .rows import BETTER, FORMS, METHODS, SYSTEMS, ByScene, Row, Study, counts
from .table2 import RIVALS, STARTS, iterations, loads

Evidence = Iterator[tuple[str, bool | None, str]]  # case, whether it holds, figures

# The thresholds that claims.csv states.
RATIO, HUNDREDS, LATE = 20, 100, 40  # CG iterations
FEW, SAME, FEASIBLE_MM, LOADS = 0.01, 1e-6, 1e-7, 8
CLOSE = 0.3  # exponents
CLEAR, FEWEST, SLIGHT = 0.8, 4, 3.0  # a rank correlation, the scenes for it, longest over shortest time
AGREE_MM = 1e-7

ORDERINGS = ("V = U + √D", "V = U + √D, open gaps last")


def _pairs(a: ByScene, b: ByScene) -> list[tuple[Row, Row]]:
    """Rows on the same scenes, both with a time or a lower bound of it."""
    pairs = [(a[scene], b[scene]) for scene in a if scene in b]
    return [(mine, other) for mine, other in pairs if mine["at_least"] and other["at_least"]]


def _clearly_faster(a: Row, b: Row) -> bool | None:
    """None if they take about as long, or a lower bound leaves it open."""
    if TIE * a["at_least"] < b["at_least"]:
        return None if a["cut"] else True
    if TIE * b["at_least"] < a["at_least"]:
        return None if b["cut"] else False
    return None


def _merged(rows: Iterable[Row], how: Callable[[list[float]], float]) -> Row:
    """The seconds of several rows as one."""
    rows = list(rows)
    return {"at_least": how([row["at_least"] for row in rows]), "cut": any(row["cut"] for row in rows)}


def _against(mine: Row, other: Row) -> str:
    a, b = (f"{'> ' * row['cut']}{significant(row['at_least'])}" for row in (mine, other))
    return f"{a} against {b} s"


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
    """V, in each ordering, than another of SYSTEMS."""

    def evidence(study: Study) -> Evidence:
        for name in mine:
            for a, b in _pairs(study.ipm(**SYSTEMS[name]), study.ipm(**SYSTEMS[rival])):
                yield f"{name}, {a['scene']}", _clearly_faster(a, b), _against(a, b)

    return evidence


# Starting points.


def _starts(study: Study, start: str = "algorithm_5") -> ByScene:
    """What the details of each row say of its start, and m."""
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
    known = []
    for active, rows in loads(study).items():
        mine, *others = (iterations(rows.get(start)) for start in ("algorithm_5", *RIVALS))
        if mine is not None and None not in others:
            holds = all(mine <= other for other in others if other is not None)
            known.append((f"{active} active", holds, f"{mine} against {' and '.join(map(str, others))}"))
    met = sum(holds for _, holds, _ in known)
    yield from known if met < LOADS else [("no more", True, f"on {met} of {len(known)} loads")]


def start_saves_time(study: Study) -> Evidence:
    for rival in RIVALS:
        pairs = _pairs(study.ipm(), study.ipm(start=rival))
        if pairs := [(a, b) for a, b in pairs if not (a["cut"] or b["cut"])]:
            mine, other = (_merged(rows, sum) for rows in zip(*pairs, strict=True))
            yield f"{STARTS[rival]}, {len(pairs)} scenes", _clearly_faster(mine, other), _against(mine, other)


# Growth with n.


def exponent_at_most(quantity: str, order: float, methods: Iterable[str]) -> Callable[[Study], Evidence]:
    """The fitted exponent, less two standard errors."""

    def evidence(study: Study) -> Evidence:
        lines = table3.quantities(study)
        for name in methods:
            if fit := table3.fitted(lines, name, quantity):
                yield name, fit.slope - 2 * fit.error <= order, f"n^{fit}"

    return evidence


def iterations_below_root(study: Study) -> Evidence:
    lines = table3.quantities(study)
    for name in METHODS[:2]:
        if fit := table3.fitted(lines, name, table3.OUTER):
            known = abs(fit.slope - 0.5) > 2 * fit.error
            yield name, fit.slope < 0.5 if known else None, f"n^{fit}"


def preparation_of_one_order(study: Study) -> Evidence:
    lines = table3.quantities(study)
    for name in FORMS:
        gi, ipm = (table3.fitted(lines, method, table3.PREPARATION) for method in (name, "IPM"))
        if gi and ipm:
            spread = 2 * math.hypot(gi.error, ipm.error)
            holds = abs(gi.slope - ipm.slope) <= max(CLOSE, spread)
            yield name, holds, f"n^{gi} against n^{ipm}"


def gi_prepares_longer(study: Study) -> Evidence:
    lines = table3.quantities(study)
    own = {name: {r["n"]: r[table3.OWN] for r in lines if r["method"] == name} for name in METHODS}
    for name in FORMS:
        both = [(own[name][n], own["IPM"][n]) for n in own[name] if n in own["IPM"]]
        if both := [pair for pair in both if None not in pair]:
            gi, ipm = map(significant, both[-1])
            yield name, all(gi > ipm for gi, ipm in both), f"{gi} against {ipm} s at the largest size"


def ipm_needs_less_memory(study: Study) -> Evidence:
    for n in study.sizes:
        mib = {name: [r["working_mib"] or 0.0 for r in study.of(name, n).values()] for name in METHODS}
        most = {name: max(values, default=0.0) for name, values in mib.items()}
        for name in FORMS:
            if most["IPM"] and most[name]:
                holds = most["IPM"] < most[name]
                yield f"{name}, n = {n}", holds, f"{whole(most['IPM'])} against {whole(most[name])} MiB"


# Active contacts, and the two methods beside each other.


def _timed(study: Study, method: str, n: int) -> list[Row]:
    """By active contacts."""
    rows = [row for row in study.of(method, n).values() if row["at_least"]]
    return sorted(rows, key=lambda row: row["active"])


def trend(method: str, sign: int) -> Callable[[Study], Evidence]:
    """The rank correlation of the seconds with the active contacts has this sign."""

    def evidence(study: Study) -> Evidence:
        for n in study.sizes:
            seconds = [row["at_least"] for row in _timed(study, method, n)]
            if len(seconds) >= FEWEST:
                rho = float(np.corrcoef(np.arange(len(seconds)), np.argsort(np.argsort(seconds)))[0, 1])
                yield f"n = {n}", sign * rho >= CLEAR, f"{rho:+.2f}"

    return evidence


def time_hardly_depends_on_contact(study: Study) -> Evidence:
    for n in study.sizes:
        times = {name: [row["at_least"] for row in _timed(study, name, n)] for name in ("IPM", *FORMS)}
        spread = {name: max(s) / min(s) for name, s in times.items() if len(s) >= FEWEST}
        if "IPM" in spread and len(spread) > 1:
            figures = ", ".join(f"{name} {ratio:.1f}" for name, ratio in spread.items())
            yield f"n = {n}", spread["IPM"] <= min(SLIGHT, *spread.values()), figures


def faster_at_half_contact(rival: str, *, once: bool = False) -> Callable[[Study], Evidence]:
    """The interior-point method, where half of m is active, at each size; `once`: one size is enough."""

    def evidence(study: Study) -> Evidence:
        found = []
        for n in study.sizes:
            mine, other = _at_half(study, "IPM", n), _at_half(study, rival, n)
            if mine and other:
                faster = bool(mine["at_least"] < other["at_least"])
                known = not (mine if faster else other)["cut"]
                found.append((f"n = {n}", faster if known else None, _against(mine, other)))
        met = [case for case in found if case[1]]
        yield from met if once and met else found

    return evidence


def _at_half(study: Study, method: str, n: int) -> Row | None:
    """The seconds there, their logarithm interpolated in the active contacts; None outside their range."""
    rows = _timed(study, method, n)
    below, above = ([r for r in rows if sign * (2 * r["active"] - r["m"]) <= 0] for sign in (1, -1))
    if not below or not above:
        return None
    low, high = below[-1], above[0]
    places = [low["active"], high["active"]]
    return _merged((low, high), lambda s: math.exp(np.interp(low["m"] / 2, places, np.log(s))))


def displacements_agree(study: Study) -> Evidence:
    ipm = {scene: row["displacement_error_mm"] for scene, row in study.of("IPM").items()}
    for name in FORMS:
        gi = {scene: row["displacement_error_mm"] for scene, row in study.of(name).items()}
        apart = [e + ipm[scene] for scene, e in gi.items() if e is not None and ipm.get(scene) is not None]
        if apart:
            yield name, max(apart) <= AGREE_MM, f"at most {power(max(apart))} mm on {len(apart)} scenes"


def _worst_below(study: Study, rival: str, n: int) -> tuple[bool | None, str]:
    """Whether the longest time of the interior-point method is below that of a rival."""
    mine, other = (_timed(study, name, n) for name in ("IPM", rival))
    if not mine or not other:
        return None, "not measured"
    a, b = (max(rows, key=lambda row: (row["at_least"], row["cut"])) for rows in (mine, other))
    below = bool(a["at_least"] < b["at_least"])
    smaller, timed, all_ = (a, mine, study.of("IPM", n)) if below else (b, other, study.of(rival, n))
    known = not smaller["cut"] and len(timed) == len(all_)  # it could be longer
    return below if known else None, _against(a, b)


def worst_case_below(study: Study) -> Evidence:
    for n in study.sizes:
        for name in FORMS:
            holds, figures = _worst_below(study, name, n)
            if figures != "not measured":
                yield f"{name}, n = {n}", holds, figures


def _mean_below(study: Study, rival: str, n: int) -> tuple[bool | None, str]:
    """Of the geometric means over the scenes of both."""
    pairs = _pairs(study.of("IPM", n), study.of(rival, n))
    if not pairs:
        return None, "not measured"
    mine, other = (_merged(rows, _geometric_mean) for rows in zip(*pairs, strict=True))
    return _clearly_faster(mine, other), _against(mine, other)


def _geometric_mean(values: list[float]) -> float:
    return float(np.exp(np.log(values).mean()))


def gi_is_faster_if_well_chosen(study: Study) -> Evidence:
    for n in study.sizes:
        ipm_faster, figures = _mean_below(study, BETTER, n)
        if figures != "not measured":
            yield f"n = {n}", None if ipm_faster is None else not ipm_faster, f"IPM {figures}"


def ipm_suits_large_problems(study: Study) -> Evidence:
    for n in study.sizes[-1:]:
        for name in (*FORMS, BETTER):
            (mean, means), (worst, worsts) = _mean_below(study, name, n), _worst_below(study, name, n)
            if means != "not measured":
                holds = False if False in (mean, worst) else None if None in (mean, worst) else True
                yield f"{name}, n = {n}", holds, f"mean {means}, worst {worsts}"


#: By the claim's name in claims.csv.
EVIDENCE: dict[str, Callable[[Study], Evidence]] = {
    "few CG iterations": cg_from_thousands_to_few,
    "few to the end": few_cg_to_the_end,
    "no preconditioner": faster_than("V = I", ORDERINGS[:1]),
    "U alone": u_needs_more_cg_than_v,
    "splitting": faster_than("splitting"),
    "iterative or direct": faster_than("direct Cholesky"),
    "row sums": no_correction,
    "corrections": few_corrections,
    "feasible start": only_algorithm_5_is_feasible,
    "Algorithms 4 and 5": algorithms_4_and_5_agree,
    "Algorithm 5 iterations": fewer_iterations,
    "start saves time": start_saves_time,
    "iterations below √m": iterations_below_root,
    "IPM working time": exponent_at_most(table3.PER_SYSTEM, 2.5, METHODS[:2]),
    "GI working time": exponent_at_most(table3.PER_PIVOT, 2.0, FORMS),
    "preparation": preparation_of_one_order,
    "inversion": gi_prepares_longer,
    "less memory": ipm_needs_less_memory,
    "memory grows": exponent_at_most(table3.MEMORY, 2.0, ("IPM", *FORMS)),
    "GI primal trend": trend("GI primal", 1),
    "GI dual trend": trend("GI dual", -1),
    "IPM spread": time_hardly_depends_on_contact,
    "half contact, primal": faster_at_half_contact("GI primal"),
    "half contact, dual": faster_at_half_contact("GI dual", once=True),
    "agreement": displacements_agree,
    "worst case": worst_case_below,
    "GI chosen well": gi_is_faster_if_well_chosen,
    "conclusion": ipm_suits_large_problems,
}
