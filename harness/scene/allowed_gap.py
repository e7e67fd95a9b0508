"""Decides whether and where gaps are larger than allowed, in an answer or in all cases of a series.

A gap y is known up to an error e (harness/verification/assess.py). It is larger than allowed if y − e is, and
not larger if y + e is not. Between the two it cannot be told, nor for an allowed gap below e. A case is
judged by its largest gap and its gap_error_mm; it is undecided if its row has no gap_error_mm. A series
stores gaps as float32, whose rounding, 6e-8 of the gap, is added to e.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.results import series_file
from harness.results.series_file import CHECK
from problems.errors import InputError
from problems.forms.assembly import Mask, Vector
from problems.model.effect import GapEffect
from problems.model.scene import JointScene, Scene
from report.document.numbers import beside, counted, percent_interval, position, proven_to

from .mesh_error import MeshError
from .solution import Solution

if TYPE_CHECKING:
    import pandas as pd

    from report.results.series_results import Series

CONFIDENCE = 0.95  # of the interval for a share
SHARE = 0.95  # of the cases that must keep a limit, by default
ROUNDING = 2.0**-24


def refuse_unusable(allowed_mm: float | None) -> None:
    """Raise InputError unless it is a length, or None."""
    if allowed_mm is not None and not 0 <= allowed_mm < inf:
        raise InputError.one("--allow-gap", "gap, mm", allowed_mm, "must be 0 or larger, and finite")


def larger(allowed_mm: float, gap: Vector, e: Vector) -> tuple[Mask, Mask]:
    """Two masks (k,): the gaps that are larger than allowed, and those of which that cannot be told.

    gap : (k,) mm. e : (k,) mm, the error of each.
    """
    told = allowed_mm >= e
    certain = told & (gap - e > allowed_mm)
    return certain, ~told | (~certain & (gap + e > allowed_mm))


def share_interval(
    kept: int, count: int, unknown: int = 0, confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """The exact interval (Clopper and Pearson) for the share of all cases that `kept` of `count` cases show.

    It covers that share with no less than the confidence. unknown : how many further cases may keep the limit
    or not: at the lower end none of them does, at the upper end all of them do.
    """
    from scipy.stats import binomtest  # slow to import: not before the first row

    low, high = (binomtest(some, count).proportion_ci(confidence) for some in (kept, kept + unknown))
    return float(low.low), float(high.high)


def share_in_words(kept: int, count: int, unknown: int) -> str:
    """the share of joints is 64.55 to 88.44 %, with 95 % confidence"""
    interval = percent_interval(share_interval(kept, count, unknown), 2)
    return f"the share of joints is {interval}, with {100 * CONFIDENCE:g} % confidence"


def check_answer(
    solution: Solution, allowed_mm: float, pairs: list[dict[str, Any]], mesh: MeshError | None
) -> dict[str, Any]:
    """The entry `allowed_gap` of solution.json. pairs : the contacts of each pair, by start and stop."""
    check = checked(allowed_mm, solution.gap, solution.gap_error_mm, pairs)
    if mesh is not None and abs(check["largest_mm"] - allowed_mm) <= mesh.error_mm:
        check["closer_than_grid_mm"] = mesh.error_mm
    beyond = _beyond_scan(solution.problem.scene, check["contacts"])
    return check | ({"beyond_scan": beyond} if beyond else {})


def checked(
    allowed_mm: float, gap: Vector, uncertainty: Vector, pairs: list[dict[str, Any]]
) -> dict[str, Any]:
    """The check of the gaps (m,) mm: `exceeded` is None where it cannot be told; `contacts` are those whose
    gap is larger, the largest first. uncertainty : (m,) mm.
    """
    exceeds, undecided = larger(allowed_mm, gap, uncertainty)
    contacts, worst = np.flatnonzero(exceeds), float(uncertainty.max(initial=0.0))
    untold = allowed_mm < worst or (not len(contacts) and undecided.any())
    spans = [(" – ".join(pair["pair"]), exceeds[pair["start"] : pair["stop"]]) for pair in pairs]
    return {
        "allowed_mm": allowed_mm,
        "exceeded": None if untold else bool(len(contacts)),
        "uncertainty_mm": worst,
        "largest_mm": float(gap.max(initial=0.0)),
        "share": len(contacts) / len(gap) if len(gap) else 0.0,
        "contacts": contacts[np.argsort(-gap[contacts], kind="stable")].tolist(),
        "pairs": [name for name, some in spans if some.any()],
    }


def _beyond_scan(scene: Scene, contacts: list[int]) -> str:
    """How many of these contacts, and of all, are beyond the points of a measured gap; empty if none is."""
    if not isinstance(scene, JointScene):
        return ""
    beyond = [effect.beyond(scene.joint) > 0 for effect in scene.effects_of(GapEffect)]
    if not (some := np.any(beyond, axis=0)).any():
        return ""
    return f"{some.sum()} of {counted(some.size, 'contact')} are beyond the measured points" + (
        f", {some[contacts].sum()} of those that exceed" if contacts else ""
    )


def check_series(directory: Path, allowed_mm: float) -> dict[str, Any]:
    """The outcome for a series whose cases all have rows, recorded in it, with allowed-gap.csv and .png.

    kind : pass, fail, or "" where it cannot be told. said : sentences, the outcome last.
    """
    from report.results.series_results import read  # slow to import: not before the first row
    from report.writers.exceeding_files import write

    series = read(directory)
    result = exceeding(series, allowed_mm)
    write(directory, series, allowed_mm, result.shares, result.largest)
    answered, exceed, count = result.answered, len(result.cases), sum(series.counts.values())
    within, cases = answered - exceed - result.undecided, counted(count, "case")
    sure = f"Surely within {allowed_mm:g} mm: {within} of {cases}"
    if answered and not series.swept:  # steps are no sample
        free, per_point = exceeding(series.independent, allowed_mm), series.facts.get("cases_per_point", 1)
        drawn = count * min(per_point, 2) // per_point  # answered or not
        kept = free.answered - len(free.cases) - free.undecided
        sure += f"; {share_in_words(kept, drawn, drawn - len(free.cases) - kept)}"
    kind, said = "" if result.undecided or answered < count else "pass", [f"{sure}."]
    untold = {f"gaps are {proven_to(result.uncertainty_mm)}": result.undecided}
    untold["there is no answer"] = count - answered
    for why, some in untold.items():
        if some:
            what = f"it cannot be told whether a gap is larger than {allowed_mm:g} mm: {why}"
            said.append(f"In {some} of {cases} {what}.")
    if exceed:
        kind, worst, often = "fail", result.cases.iloc[0], int(np.argmax(result.shares))
        most = beside(allowed_mm)(worst["max_gap_mm"])
        contacts = f"{np.count_nonzero(result.shares)} of {counted(len(result.shares), 'contact')}"
        at = "" if series.nodes is None else f", {position(series.nodes[often], series.nodes)}"
        said.append(
            f"FAIL: the gap is larger than {allowed_mm:g} mm in {exceed} of {cases} "
            f"({exceed / count:.1%}), at {contacts}, most often ({result.shares[often]:.1%}) at contact "
            f"{often}{at}; the largest is {most} mm, in case {worst['case']:.0f}."
        )
    elif kind:
        most = f"the largest is {beside(allowed_mm)(series.cases['max_gap_mm'].max())} mm"
        said.append(f"PASS: in none of {cases} is a gap larger than {allowed_mm:g} mm; {most}.")
    check = {"kind": kind, "said": said, "allowed_mm": allowed_mm}
    series_file.add_facts(directory, {CHECK: check})
    return check


@dataclass(frozen=True)
class Exceeding:
    """The check of a series.

    cases : those that exceed the allowed gap, the worst first, of `answered`. shares : (m,), at each contact,
    the share of the answered cases whose gap there is larger. largest : (m,) mm, of `cases`.
    """

    answered: int
    cases: pd.DataFrame
    undecided: int
    uncertainty_mm: float
    shares: Vector
    largest: Vector


def exceeding(series: Series, allowed_mm: float) -> Exceeding:
    """Compares the gaps of all cases with the allowed one."""
    gaps = series.cases["max_gap_mm"].to_numpy()
    e = series.cases["gap_error_mm"].fillna(np.inf).to_numpy() + ROUNDING * abs(gaps)
    exceeds, undecided = larger(allowed_mm, gaps, e)
    cases = series.cases.assign(e=e)[exceeds].sort_values("max_gap_mm", ascending=False, kind="stable")
    counts, largest = np.zeros(series.gaps.m), np.zeros(series.gaps.m)
    for block, some in series.of_cases(cases):
        counts += (some - block["e"].to_numpy()[:, None] > allowed_mm).sum(axis=0)
        largest = np.maximum(largest, some.max(axis=0))
    shares = counts / max(len(gaps), 1)
    return Exceeding(len(gaps), cases, int(undecided.sum()), float(e.max(initial=0.0)), shares, largest)
