"""Claims of sections 6 and 7: the interior-point method against Goldfarb–Idnani."""

from __future__ import annotations

from typing import Any

import pandas as pd

from ...numbers import power, significant
from ...standings import geometric_mean
from .claims_linear import is_faster, pairs
from .crossings import BETTER, below, sizes, worst
from .selection import method, records, timed
from .verdict import Claim, Measured, Verdict, decided

RIVALS = ("GI primal", "GI dual")
AGREE_MM = 1e-7


def _agree(measured: Measured) -> Verdict:
    outcomes: dict[str, bool | None] = {}
    largest, keys = 0.0, []
    mine = method(measured.cells, "IPM").set_index("scene")
    for name in RIVALS:
        for row in records(method(measured.cells, name)):
            scene = row["scene"]
            errors = [row["displacement_error_mm"]]
            errors += [mine.loc[scene, "displacement_error_mm"]] if scene in mine.index else [None]
            if any(error is None or pd.isna(error) for error in errors):
                outcomes[f"{name}, scene {scene}"] = None
                continue
            most, least = sum(errors), abs(errors[0] - errors[1])  # how far apart the answers can be
            holds = True if most <= AGREE_MM else False if least > AGREE_MM else None
            outcomes[f"{name}, scene {scene}"] = holds
            largest = max(largest, most)
            keys += [row["key"], str(mine.loc[scene, "key"])]
    evidence = f"at most {power(largest)} mm apart on {len(keys) // 2} pairs of answers"
    return decided(outcomes, "the scene", evidence if keys else "", keys)


def _worst_below(measured: Measured) -> Verdict:
    outcomes: dict[str, bool | None] = {}
    words, keys = [], []
    for n in sizes(measured.cells):
        mine = worst(measured.cells, n, "IPM")
        for name in (*RIVALS, BETTER):
            other = worst(measured.cells, n, name)
            if mine is None or other is None:
                continue
            if name != BETTER:
                outcomes[f"{name}, n = {n}"] = below(mine, other)
            words.append(f"n = {n}: IPM {mine}, {name} {other}")
            keys += [mine.key, other.key]
    return decided(outcomes, "the form and the size", "; ".join(words), keys)


def _good_when_known(measured: Measured) -> Verdict:
    """The better form of Goldfarb–Idnani, chosen for each scene, against the interior-point method."""
    outcomes: dict[str, bool | None] = {}
    words, keys = [], []
    for n in sizes(measured.cells):
        found = _against(measured, n, BETTER)
        if not found:
            continue
        mine, other, faster = _means(found)
        outcomes[f"n = {n}"] = None if faster is None else not faster
        better = sum(is_faster(pair) is False for pair in found)
        words.append(
            f"n = {n}: {significant(other)} s against the IPM's {significant(mine)} s (geometric means), "
            f"faster on {better} of {len(found)} scenes"
        )
        keys += [p[k] for p in found for k in ("key_a", "key_b")]
    return decided(outcomes, "the size", "; ".join(words), keys)


def _against(measured: Measured, n: int, name: str) -> list[dict[str, Any]]:
    of_size = measured.cells[measured.cells["n"] == n]
    rows = pd.concat([method(of_size, of) for of in (RIVALS if name == BETTER else (name,))])
    rows = timed(rows).sort_values(["at_least", "cut"], na_position="last").drop_duplicates("scene")
    return pairs(method(of_size, "IPM"), rows)


def _means(found: list[dict[str, Any]]) -> tuple[float, float, bool | None]:
    """The two geometric means over the same scenes, and whether the first is the clearly smaller."""
    mine, other = (geometric_mean(pd.Series([p[k] for p in found])) for k in ("at_least_a", "at_least_b"))
    cut = {f"cut_{k}": any(p[f"cut_{k}"] for p in found) for k in "ab"}
    return mine, other, is_faster({"at_least_a": mine, "at_least_b": other} | cut)


def _conclusion(measured: Measured) -> Verdict:
    """At the largest size: geometric mean and worst case, against each form and the better of both."""
    outcomes: dict[str, bool | None] = {}
    words, keys = [], []
    for n in sizes(measured.cells)[-1:]:
        for name in (*RIVALS, BETTER):
            found = _against(measured, n, name)
            longest = below(worst(measured.cells, n, "IPM"), worst(measured.cells, n, name))
            if not found:
                continue
            mine, other, faster = _means(found)
            both = (faster, longest)
            outcomes[name] = False if False in both else None if None in both else True
            words.append(
                f"n = {n}: IPM {significant(mine)} s, {name} {significant(other)} s (geometric means of "
                f"{len(found)} scenes)"
            )
            keys += [p[k] for p in found for k in ("key_a", "key_b")]
    return decided(outcomes, "the form of Goldfarb–Idnani", "; ".join(words), keys)


CLAIMS = [
    Claim(
        "agreement",
        "6",
        "The displacements of the two methods agree to 1e-7 mm.",
        "The errors of both answers against the reference add up to at most that; it fails where they differ "
        "by more.",
        _agree,
    ),
    Claim(
        "worst case",
        "6, Figures 5–7",
        "At large size the interior-point method's worst case is always below Goldfarb–Idnani's.",
        "The longest time over the scenes of a size is below that of each form; the better form chosen on "
        "each scene is given beside them and decides nothing.",
        _worst_below,
    ),
    Claim(
        "GI chosen well",
        "6",
        "Goldfarb–Idnani is efficient where the size of the contact area is known beforehand.",
        "Its better form on each scene is faster than the interior-point method in the geometric mean.",
        _good_when_known,
    ),
    Claim(
        "conclusion",
        "7",
        "For large problems the interior-point method suits better than Goldfarb–Idnani.",
        "At the largest size its mean and its worst case are below Goldfarb–Idnani's.",
        _conclusion,
    ),
]
