"""Claims of sections 6 and 7: the interior-point method against Goldfarb–Idnani."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pandas as pd

from report.analysis.paper.crossings import BETTER, below, sizes, worst
from report.analysis.paper.selection import of_method
from report.analysis.seconds import timed
from report.analysis.standings import geometric_mean
from report.document.blocks import records
from report.document.numbers import counted, power, significant

from .linear_systems import is_faster, pairs
from .verdict import Case, Claim, Measured, Verdict, by_case, decided

RIVALS = ("GI primal", "GI dual")
AGREE_MM = 1e-7


def _agree(measured: Measured) -> Verdict:
    cases: list[Case] = []
    largest = 0.0
    mine = of_method(measured.cells, "IPM").set_index("scene")
    for name in RIVALS:
        for row in records(of_method(measured.cells, name)):
            scene = row["scene"]
            case = f"{name}, scene {scene}"
            errors = [row["displacement_error_mm"]]
            errors += [mine.loc[scene, "displacement_error_mm"]] if scene in mine.index else [None]
            if any(error is None or pd.isna(error) for error in errors):
                cases.append(Case(case, None))
                continue
            most, least = sum(errors), abs(errors[0] - errors[1])  # how far apart the answers can be
            holds = True if most <= AGREE_MM else False if least > AGREE_MM else None
            largest = max(largest, most)
            cases.append(Case(case, holds, keys=[row["key"], str(mine.loc[scene, "key"])]))
    both = sum(bool(case.keys) for case in cases)
    evidence = f"at most {power(largest)} mm apart on {counted(both, 'pair')} of answers"
    return decided(cases, "the scene", evidence if both else "")


@by_case("the form and the size")
def _worst_below(measured: Measured) -> Iterator[Case]:
    for n in sizes(measured.cells):
        mine = worst(measured.cells, n, "IPM")
        if mine is None:
            continue
        yield Case("", None, f"n = {n}: IPM {mine}", [mine.key])
        for name in (*RIVALS, BETTER):
            other = worst(measured.cells, n, name)
            if other is not None:
                case = "" if name == BETTER else f"{name}, n = {n}"
                yield Case(case, below(mine, other), f"{name} {other}", [other.key])


@by_case("the size")
def _good_when_known(measured: Measured) -> Iterator[Case]:
    """The better form of Goldfarb–Idnani on each scene against the interior-point method."""
    for n in sizes(measured.cells):
        found = _against(measured, n, BETTER)
        if not found:
            continue
        mine, other, faster = _means(found)
        better = sum(is_faster(pair) is False for pair in found)
        words = (
            f"n = {n}: {significant(other)} s against the IPM's {significant(mine)} s (geometric means), "
            f"faster on {better} of {len(found)} scenes"
        )
        yield Case(f"n = {n}", None if faster is None else not faster, words, _keys(found))


def _keys(found: list[dict[str, Any]]) -> list[str]:
    return [pair[k] for pair in found for k in ("key_a", "key_b")]


def _against(measured: Measured, n: int, name: str) -> list[dict[str, Any]]:
    of_size = measured.cells[measured.cells["n"] == n]
    rows = pd.concat([of_method(of_size, of) for of in (RIVALS if name == BETTER else (name,))])
    rows = timed(rows).sort_values(["at_least", "cut"], na_position="last").drop_duplicates("scene")
    return pairs(of_method(of_size, "IPM"), rows)


def _means(found: list[dict[str, Any]]) -> tuple[float, float, bool | None]:
    """The two geometric means over the same scenes, and whether the first is clearly smaller."""
    mine, other = (geometric_mean(pd.Series([p[k] for p in found])) for k in ("at_least_a", "at_least_b"))
    cut = {f"cut_{k}": any(p[f"cut_{k}"] for p in found) for k in "ab"}
    return mine, other, is_faster({"at_least_a": mine, "at_least_b": other} | cut)


@by_case("the form of Goldfarb–Idnani")
def _conclusion(measured: Measured) -> Iterator[Case]:
    """At the largest size: geometric mean and worst case, against each form and the better of both."""
    for n in sizes(measured.cells)[-1:]:
        for name in (*RIVALS, BETTER):
            found = _against(measured, n, name)
            longest = below(worst(measured.cells, n, "IPM"), worst(measured.cells, n, name))
            if not found:
                continue
            mine, other, faster = _means(found)
            both = (faster, longest)
            words = (
                f"n = {n}: IPM {significant(mine)} s, {name} {significant(other)} s (geometric means of "
                f"{len(found)} scenes)"
            )
            yield Case(name, False if False in both else None if None in both else True, words, _keys(found))


CLAIMS = [
    Claim(
        "agreement",
        "6",
        "The displacements of the two methods agree to 1e-7 mm.",
        "The errors of both answers against the reference add up to at most that; it fails if they differ by "
        "more.",
        _agree,
    ),
    Claim(
        "worst case",
        "6, Figures 5–7",
        "At large size the interior-point method's worst case is always below Goldfarb–Idnani's.",
        "The longest time over the scenes of a size is below that of each form; that of the better form on "
        "each scene is given for information only.",
        _worst_below,
    ),
    Claim(
        "GI chosen well",
        "6",
        "Goldfarb–Idnani is efficient if the size of the contact area is known beforehand.",
        "Its better form on each scene is faster than the interior-point method in the geometric mean.",
        _good_when_known,
    ),
    Claim(
        "conclusion",
        "7",
        "For large problems the interior-point method is better suited than Goldfarb–Idnani.",
        "At the largest size its mean and worst case are below Goldfarb–Idnani's.",
        _conclusion,
    ),
]
