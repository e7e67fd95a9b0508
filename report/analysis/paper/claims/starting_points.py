"""Claims of section 5.4: the initial guess."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from report.analysis.paper.selection import figures_of, ipm
from report.analysis.paper.starts import RIVALS, STARTS, loads, no_more
from report.analysis.standings import TIE
from report.document.blocks import records
from report.document.numbers import as_number, power, significant, span, tidy_power, whole

from .linear_systems import pairs
from .verdict import (
    CONFIRMED,
    DEPENDS,
    NOT_CONFIRMED,
    NOT_MEASURED,
    Case,
    Claim,
    Measured,
    Verdict,
    by_case,
    decided,
)

LOADS = 8  # of Table 2's ten, on which Algorithm 5 must need no more iterations
FEW = 0.01  # of m: corrections that count as few
SAME = 1e-6  # relative difference of μ₀ at which two starts are the same point
FEASIBLE_MM = 1e-7


def _about_start(measured: Measured, start: str) -> list[tuple[str, dict[str, float], str, float]]:
    """Scene, facts of the start, key and m of every row with that start."""
    return [
        (row["scene"], facts, row["key"], row["m"])
        for row in records(ipm(measured.cells, start=start))
        if (facts := figures_of(row, "start"))
    ]


def _row_sums_positive(measured: Measured) -> Verdict:
    rows = _about_start(measured, "algorithm_5")
    cases = [Case(scene, about["corrections"] == 0, keys=[key]) for scene, about, key, _ in rows]
    evidence = f"no correction on {sum(bool(case.holds) for case in cases)} of {len(cases)} scenes"
    return decided(cases, "the scene", evidence)


def _few_corrections(measured: Measured) -> Verdict:
    rows = _about_start(measured, "algorithm_5")
    cases = [Case(s, about["corrections"] <= FEW * m, keys=[key]) for s, about, key, m in rows]
    most = max((about["corrections"] for _, about, *_ in rows), default=None)
    return decided(cases, "the scene", f"at most {whole(most)} corrections on {len(rows)} scenes")


@by_case("the start")
def _feasible(measured: Measured) -> Iterator[Case]:
    for start in ("algorithm_5", *RIVALS):
        rows = _about_start(measured, start)
        if not rows:
            continue
        worst = max(about["infeasibility_mm"] for _, about, *_ in rows)
        least = min(about["infeasibility_mm"] for _, about, *_ in rows)
        holds = worst <= FEASIBLE_MM if start == "algorithm_5" else least > FEASIBLE_MM
        words = f"{STARTS[start]}: {span(power(least), power(worst))} mm ({len(rows)} scenes)"
        yield Case(STARTS[start], holds, words, [key for *_, key, _ in rows])


@by_case("the scene")
def _same_point(measured: Measured) -> Iterator[Case]:
    of_5 = {scene: (about, key) for scene, about, key, _ in _about_start(measured, "algorithm_5")}
    for scene, about, key, _ in _about_start(measured, "algorithm_4"):
        if scene not in of_5:
            continue
        other, other_key = of_5[scene]
        apart = abs(about["mu"] - other["mu"]) / abs(other["mu"])
        equal = all(about[name] == other[name] for name in ("corrections", "multiplications"))
        words = f"scene {scene}: μ₀ {power(apart, 2)} apart (relative)"
        yield Case(scene, equal and apart <= SAME, words, [key, other_key])


def _fewer_iterations(measured: Measured) -> Verdict:
    lines = loads(measured.cells)
    known = [(line, holds) for line in lines if (holds := no_more(line)) is not None]
    if not known:
        return Verdict(NOT_MEASURED)
    met = sum(holds for _, holds in known)
    fewer = sum(_strictly_fewer(line) for line, _ in known)
    more = ", ".join(str(line["active_printed"]) for line, holds in known if not holds)
    evidence = f"no more on {met} of {len(known)} loads, fewer on {fewer}"
    printed = [bool(no_more(line, "_printed")) for line in lines]
    evidence += f" (printed: no more on {sum(printed)} of {len(printed)})"
    evidence += f"; more at {more} active" if more else ""
    if met >= LOADS:
        word = CONFIRMED
    elif met == 0 or (len(known) == len(lines) and met < len(lines) / 2):
        word = NOT_CONFIRMED
    else:
        word = f"{DEPENDS} the load: it holds on {met} of {len(known)}"
    keys = [line[f"{start}_key"] for line, _ in known for start in ("algorithm_5", *RIVALS)]
    return Verdict(word, evidence, sorted(keys))


def _strictly_fewer(line: Mapping[str, object]) -> bool:
    mine, *others = [as_number(line[f"{start}_iterations"]) for start in ("algorithm_5", *RIVALS)]
    return mine is not None and all(other is not None and mine < other for other in others)


@by_case("the other start")
def _saves_time(measured: Measured) -> Iterator[Case]:
    for rival in RIVALS:
        found = pairs(ipm(measured.cells), ipm(measured.cells, start=rival))
        exact = [pair for pair in found if not (pair["cut_a"] or pair["cut_b"])]
        if not exact:
            continue
        mine, other = (sum(pair[name] for pair in exact) for name in ("at_least_a", "at_least_b"))
        close = max(mine, other) <= TIE * min(mine, other)
        words = (
            f"{significant(mine)} s in all against {significant(other)} s of {STARTS[rival]} "
            f"({len(exact)} scenes)"
        )
        keys = [pair[name] for pair in exact for name in ("key_a", "key_b")]
        yield Case(f"against {STARTS[rival]}", None if close else mine < other, words, keys)


CLAIMS = [
    Claim(
        "row sums",
        "5.4",
        "If Q has positive row sums, Algorithm 5 starts from equal forces; every contact problem here does.",
        "Equal forces needed no correction: every row sum of Q is positive.",
        _row_sums_positive,
    ),
    Claim(
        "corrections",
        "5.4",
        "The correction of the forces below (16) ends soon.",
        f"At most {FEW:.0%} of m corrections on every scene.",
        _few_corrections,
    ),
    Claim(
        "feasible start",
        "5.4",
        "Algorithm 5 gives a feasible start; those of STP1 and STP2 are infeasible.",
        f"max |y − (Qλ − p)| at most {tidy_power(FEASIBLE_MM)} mm with Algorithm 5, more with the others.",
        _feasible,
    ),
    Claim(
        "Algorithms 4 and 5",
        "5.4",
        "Algorithms 4 and 5 are equivalent.",
        f"The same multiplications and corrections, and μ₀ equal to {tidy_power(SAME)} (relative).",
        _same_point,
    ),
    Claim(
        "Algorithm 5 iterations",
        "5.4, Table 2",
        "Algorithm 5 needs fewer iterations than STP1 and STP2.",
        f"No more than either on at least {LOADS} of the ten loads.",
        _fewer_iterations,
    ),
    Claim(
        "start saves time",
        "7",
        "The choice of the initial guess reduces the working time.",
        f"Seconds per load case, summed over the scenes of both; a difference below {TIE - 1:.0%} decides "
        "nothing.",
        _saves_time,
    ),
]
