"""Claims of section 6 on how the time depends on the number of active contacts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import pandas as pd

from report.analysis.paper.crossings import at_share, sizes
from report.analysis.paper.selection import of_method
from report.analysis.seconds import timed
from report.document.numbers import significant

from .verdict import Case, Claim, Measured, by_case

RIVALS = ("GI primal", "GI dual")
CLEAR = 0.8  # rank correlation that counts as a trend
FEWEST = 4  # scenes for a trend or a spread
SLIGHT = 3.0  # longest over shortest time that counts as a slight influence


def _of_size(measured: Measured, name: str, n: int) -> pd.DataFrame:
    rows = timed(of_method(measured.cells, name))
    return rows[(rows["n"] == n) & rows["at_least"].notna()]


def _trend(measured: Measured, name: str, sign: int) -> Iterator[Case]:
    """Rank correlation of the seconds with the active contacts per size, stopped runs at their limit."""
    for n in sizes(measured.cells):
        rows = _of_size(measured, name, n)
        if len(rows) < FEWEST:
            continue
        rho = float(rows["active"].rank().corr(rows["at_least"].rank()))
        cut = f", {rows['cut'].sum()} stopped by the clock" if rows["cut"].any() else ""
        words = f"n = {n}: {rho:+.2f} ({len(rows)} scenes{cut})"
        yield Case(f"n = {n}", sign * rho >= CLEAR, words, rows["key"].tolist())


@by_case("the size")
def _primal_grows(measured: Measured) -> Iterable[Case]:
    return _trend(measured, "GI primal", 1)


@by_case("the size")
def _dual_falls(measured: Measured) -> Iterable[Case]:
    return _trend(measured, "GI dual", -1)


@by_case("the size")
def _hardly_depends(measured: Measured) -> Iterator[Case]:
    for n in sizes(measured.cells):
        spreads: dict[str, float] = {}
        keys: list[str] = []
        for name in ("IPM", *RIVALS):
            rows = _of_size(measured, name, n)
            if len(rows) >= FEWEST:
                spreads[name] = rows["at_least"].max() / rows["at_least"].min()
                keys += rows["key"].tolist()
        if "IPM" not in spreads or len(spreads) < 2:
            continue
        others = [spread for name, spread in spreads.items() if name != "IPM"]
        holds = spreads["IPM"] <= SLIGHT and spreads["IPM"] < min(others)
        words = f"n = {n}: " + ", ".join(f"{name} {s:.1f}" for name, s in spreads.items())
        yield Case(f"n = {n}", bool(holds), words, keys)


def _half(measured: Measured, name: str) -> Iterator[Case]:
    """By size, whether the interior-point method is faster at half contact."""
    for n in sizes(measured.cells):
        mine, other = (at_share(measured.cells, n, of, 0.5) for of in ("IPM", name))
        if mine is None or other is None:
            continue
        faster = mine[0] < other[0]
        holds = None if (mine[1] if faster else other[1]) else faster
        bound = "> " if other[1] else ""
        words = f"n = {n}: IPM {significant(mine[0])} s, {name} {bound}{significant(other[0])} s"
        yield Case(f"n = {n}", holds, words, mine[2] + other[2])


@by_case("the size")
def _half_primal(measured: Measured) -> Iterable[Case]:
    return _half(measured, "GI primal")


@by_case("the size")
def _half_dual(measured: Measured) -> Iterable[Case]:
    """'For some problems': one size confirms it."""
    cases = list(_half(measured, "GI dual"))
    some = any(case.holds for case in cases)
    return [replace(case, holds=True) for case in cases] if some else cases


CLAIMS = [
    Claim(
        "GI primal trend",
        "6, Figures 5–7",
        "Goldfarb–Idnani on the primal problem takes longer the more contacts are active.",
        f"Rank correlation of time and active contacts at least +{CLEAR}, at each size.",
        _primal_grows,
    ),
    Claim(
        "GI dual trend",
        "6, Figures 5–7",
        "Goldfarb–Idnani on the dual problem takes longer the fewer contacts are active.",
        f"Rank correlation of time and active contacts at most −{CLEAR}, at each size.",
        _dual_falls,
    ),
    Claim(
        "IPM spread",
        "6, Figures 5–7",
        "The interior-point method's time hardly depends on the active contacts.",
        f"Longest over shortest time at most {SLIGHT:g}, and below Goldfarb–Idnani's in both forms (printed, "
        "Table 2, Algorithm 5: 2.6).",
        _hardly_depends,
    ),
    Claim(
        "half contact, primal",
        "6",
        "With half of the contacts active the interior-point method is always faster than Goldfarb–Idnani on "
        "the primal problem.",
        "Seconds at 50 % active, interpolated between the scenes around it, at each size.",
        _half_primal,
    ),
    Claim(
        "half contact, dual",
        "6",
        "With half of the contacts active it is, for some problems, also faster than Goldfarb–Idnani on the "
        "dual problem.",
        "As before; one size on which it holds confirms it.",
        _half_dual,
    ),
]
