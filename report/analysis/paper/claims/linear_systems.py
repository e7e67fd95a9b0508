"""Claims of section 5.3: the linear systems and the preconditioner."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import pandas as pd

from report.analysis.paper.cg import SYSTEMS, counts
from report.analysis.paper.selection import ipm
from report.analysis.paper.targets import LATE, ORDERINGS, RATIO, largest_late, ratios
from report.analysis.seconds import timed
from report.analysis.standings import TIE
from report.document.blocks import records
from report.document.numbers import significant

from .verdict import Case, Claim, Measured, by_case

HUNDREDS = 100


@by_case("the ordering or the scene")
def _few_instead_of_thousands(measured: Measured) -> Iterator[Case]:
    for ordering in ORDERINGS:
        for ratio in ratios(measured.cells, ordering):
            holds = None if ratio.met is None else ratio.met and ratio.none.largest >= HUNDREDS
            words = f"{ordering}, {ratio}, {ratio.none.largest} and {ratio.V.largest} at most per system"
            yield Case(f"{ordering}, scene {ratio.scene}", holds, words, ratio.keys)


@by_case("the ordering or the size")
def _few_to_the_end(measured: Measured) -> Iterator[Case]:
    for ordering, of_sizes in largest_late(measured.cells).items():
        for n, (count, scene, key) in sorted(of_sizes.items()):
            name = f"{ordering}, n = {n}"
            yield Case(name, count <= LATE, f"{name}: {count} (scene {scene})", [key])


@by_case("the scene")
def _needs_a_preconditioner(measured: Measured) -> Iterable[Case]:
    return _faster(measured, ["V = U + √D"], "V = I")


@by_case("the scene")
def _diagonal_matters(measured: Measured) -> Iterator[Case]:
    """U alone against V: CG iterations per solve."""
    V, U = (ipm(measured.cells, **SYSTEMS[name]) for name in ("V = U + √D", "U alone"))
    for scene in [s for s in U["scene"] if s in set(V["scene"])]:
        rows = [r[r["scene"] == scene].iloc[0].to_dict() for r in (V, U)]
        with_d, without = (counts(row) for row in rows)
        if not with_d or not without:
            continue
        more = without.total > with_d.total
        holds = None if (without.cut and not more) or (with_d.cut and more) else more
        words = f"scene {scene}: U {'≥ ' if without.cut else ''}{without.total}, V {with_d.total}"
        yield Case(f"scene {scene}", holds, words, [row["key"] for row in rows])


@by_case("the ordering or the scene")
def _better_than_splitting(measured: Measured) -> Iterable[Case]:
    return _faster(measured, ORDERINGS, "splitting")


@by_case("the ordering or the scene")
def _iterative_beats_direct(measured: Measured) -> Iterable[Case]:
    return _faster(measured, ORDERINGS, "direct Cholesky")


def _faster(measured: Measured, mine: Iterable[str], rival: str) -> Iterator[Case]:
    """Seconds per load case by scene; a difference below TIE decides nothing."""
    for name in mine:
        for pair in pairs(ipm(measured.cells, **SYSTEMS[name]), ipm(measured.cells, **SYSTEMS[rival])):
            case = f"{name}, scene {pair['scene']}"
            words = f"{case}: {times_text(pair)} s with {rival}"
            yield Case(case, is_faster(pair), words, [pair["key_a"], pair["key_b"]])


def pairs(a: pd.DataFrame, b: pd.DataFrame) -> list[dict[str, Any]]:
    """Two lines scene by scene, if both have a time or a lower bound of it."""
    names = ["scene", "n", "at_least", "cut", "key"]
    both = timed(a)[names].merge(timed(b)[names], on=["scene", "n"], suffixes=("_a", "_b"))
    return records(both.dropna(subset=["at_least_a", "at_least_b"]))


def is_faster(pair: dict[str, Any]) -> bool | None:
    """Whether a is clearly faster than b; None if they are nearly equal or a lower bound leaves it open."""
    a, b = pair["at_least_a"], pair["at_least_b"]
    if TIE * a < b:
        return None if pair["cut_a"] else True
    if TIE * b < a:
        return None if pair["cut_b"] else False
    return None


def times_text(pair: dict[str, Any]) -> str:
    a, b = (f"{'> ' if pair[f'cut_{k}'] else ''}{significant(pair[f'at_least_{k}'])}" for k in "ab")
    return f"{a} against {b}"


FASTER = f"Seconds per load case on each scene with both; a difference below {TIE - 1:.0%} decides nothing."

CLAIMS = [
    Claim(
        "few CG iterations",
        "5.3, Table 1",
        "V = U + √D brings the CG iterations per system from hundreds or thousands down to a few.",
        f"V = I takes at least {HUNDREDS} for some system, and V at most 1/{RATIO} of its sum over a solve.",
        _few_instead_of_thousands,
    ),
    Claim(
        "few to the end",
        "5.3, Table 1",
        "With V, a few CG iterations are enough up to the last outer iterations.",
        f"No system in the second half of any solve takes more than {LATE} (printed: 23).",
        _few_to_the_end,
    ),
    Claim(
        "no preconditioner",
        "5.3",
        "Without a preconditioner an iterative method is not efficient on these systems.",
        "V = U + √D is faster than V = I. " + FASTER,
        _needs_a_preconditioner,
    ),
    Claim(
        "U alone",
        "5.3",
        "U alone is not enough, because it ignores the diagonal D.",
        "U alone takes more CG iterations, summed over a solve, than V.",
        _diagonal_matters,
    ),
    Claim(
        "splitting",
        "5.3",
        "V is an efficient choice, and easier to build than a splitting preconditioner.",
        "V is faster than the splitting preconditioner. " + FASTER,
        _better_than_splitting,
    ),
    Claim(
        "iterative or direct",
        "5.3",
        "Only an iterative method solves the system in less than O(n³).",
        "At these sizes V would then be faster than a Cholesky factorisation of every H. " + FASTER,
        _iterative_beats_direct,
    ),
]
