"""Whether remaining gaps are larger than allowed, and where: of an answer, or of all cases of a series.

A gap y is known up to an e (harness/verification/assess.py). It is larger than allowed if y − e is, and
not if y + e is not; between the two nothing can be said, nor of an allowed gap below e. A case is judged by
its largest gap and its gap_error_mm; it is undecided if its row does not say how well its gaps are known.
The gaps of the contacts are stored as float32, whose rounding, 6e-8 of the gap, is added.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console

from harness.results import series_file
from harness.results.records import to_line
from harness.terminal import DONE, GAP_EXCEEDED, NOTHING_JUDGED
from problems.errors import InputError
from problems.forms.assembly import Mask, Vector
from report.document.numbers import position

if TYPE_CHECKING:
    import pandas as pd

    from report.results.series_results import Series

CHECK = "allowed_gap"  # in the facts of a series
#: Exit code and colour of an outcome.
OUTCOMES = {"pass": (DONE, "green"), "fail": (GAP_EXCEEDED, "red"), "": (NOTHING_JUDGED, "yellow")}
CONFIDENCE = 0.95  # of the interval of Clopper and Pearson for a share
ROUNDING = 2.0**-24


def refuse_unusable(allowed_mm: float | None) -> None:
    """Raise InputError unless it is a length, or None."""
    if allowed_mm is not None and not 0 <= allowed_mm < inf:
        raise InputError.one("--allow-gap", "gap, mm", allowed_mm, "must be 0 or larger, and finite")


def checked(
    allowed_mm: float, gap: Vector, uncertainty: Vector, pairs: list[dict[str, Any]]
) -> dict[str, Any]:
    """What is recorded of the check: `exceeded` is None where it cannot be told. `contacts` are those whose
    gap is larger, the largest first. gap, uncertainty : (m,) mm.
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
        "pairs": [name for name, own in spans if own.any()],
    }


def show(check: dict[str, Any], gap: Vector, nodes: Vector | None, console: Console) -> int:
    """Print the outcome for an answer, with the place of its largest gap; returns the exit code."""
    allowed, largest, contacts = check["allowed_mm"], check["largest_mm"], check["contacts"]
    if check["exceeded"] is None:
        console.print(_untold("It", allowed, check["uncertainty_mm"]), style="yellow")
        return NOTHING_JUDGED
    near = ""
    if (grid := check.get("closer_than_grid_mm")) is not None:
        near = f". This is closer to the limit than the grid can tell, about {grid:.1g} mm"
    if "beyond_scan" in check:
        near += f". {check['beyond_scan']}"
    if not contacts:
        said = f"no gap is larger than {allowed:g} mm; the largest is {largest:.3g} mm{near}"
        console.print(f"PASS: {said}.", style="green")
        return DONE
    console.print(
        f"FAIL: the gap is larger than {allowed:g} mm at {len(contacts)} of {len(gap)} contacts, "
        f"{check['share']:.1%} of the junction, between {', '.join(check['pairs'])}; the largest is "
        f"{largest:.3g} mm, at {_place(contacts[0], nodes)}{near}. All of them: exceeding.csv",
        style="red",
    )
    return GAP_EXCEEDED


def check_series(directory: Path, allowed_mm: float) -> dict[str, Any]:
    """The outcome for a series, recorded in it, with DIRECTORY/allowed-gap.csv and .png.

    kind : pass, fail, or "" where it cannot be told. said : sentences, the outcome last.
    """
    from scipy.stats import binomtest  # slow to import, as is the report: not before the first row

    from report.results.series_results import read

    series = read(directory)
    found = exceeding(series, allowed_mm)
    write(directory, series, found)
    within = found.answered - len(found.cases) - found.undecided
    sure = f"{within} of {found.answered} cases are surely within {allowed_mm:g} mm"
    if found.answered and not series.swept:  # steps are no sample
        low, high = binomtest(within, found.answered).proportion_ci(CONFIDENCE, "exact")
        sure += f": the share of joints is between {low:.2%} and {high:.2%}, with {CONFIDENCE:.0%} confidence"
    kind, said = "" if found.undecided or not found.answered else "pass", [f"{sure}."]
    if found.undecided:
        where = f"In {found.undecided} of {found.answered} cases it"
        said.append(_untold(where, allowed_mm, found.uncertainty_mm))
    if len(found.cases):
        kind, worst, share = "fail", found.cases.iloc[0], len(found.cases) / found.answered
        often = int(np.argmax(found.shares))
        said.append(
            f"FAIL: the gap is larger than {allowed_mm:g} mm in {len(found.cases)} of {found.answered} cases "
            f"({share:.1%}), at {np.count_nonzero(found.shares)} of {len(found.shares)} contacts, most often "
            f"({found.shares[often]:.1%}) at {_place(often, series.nodes)}; the largest is "
            f"{worst['max_gap_mm']:.3g} mm, in case {worst['case']:.0f}."
        )
    elif kind:
        largest = f"the largest is {series.cases['max_gap_mm'].max():.3g} mm"
        said.append(
            f"PASS: in none of {found.answered} cases is a gap larger than {allowed_mm:g} mm; {largest}."
        )
    check = {"kind": kind, "said": said}
    facts = series_file.read_facts(directory) or {}
    series_file.write_fact(directory, "series", to_line(facts | {CHECK: check}))
    return check


def show_series(check: dict[str, Any], console: Console) -> int:
    """Print the outcome for a series; returns the exit code."""
    first, *rest = check["said"]
    console.print(first)
    code, style = OUTCOMES[check["kind"]]
    for sentence in rest:
        console.print(sentence, style=style)
    return code


def _place(contact: int, nodes: Vector | None) -> str:
    at = "" if nodes is None else f", {position(*nodes[contact])}"
    return f"contact {contact}{at}"


def _untold(it: str, allowed_mm: float, uncertainty_mm: float) -> str:
    told = f"whether a gap is larger than {allowed_mm:g} mm: gaps are proven only to {uncertainty_mm:.1e} mm"
    return f"{it} cannot be told {told}."


@dataclass(frozen=True)
class Exceeding:
    """cases : those that exceed the allowed gap, the worst first, of `answered`. shares : (m,), at each
    contact, the share of the answered cases whose gap there is larger. largest : (m,) mm, of the cases above.
    """

    allowed_mm: float
    answered: int
    cases: pd.DataFrame
    undecided: int
    uncertainty_mm: float
    shares: Vector
    largest: Vector


def larger(allowed_mm: float, gap: Vector, e: Vector) -> tuple[Mask, Mask]:
    """Which gaps, (k,) mm known up to e (k,), are larger than allowed, and of which that cannot be told."""
    told = allowed_mm >= e
    certain = told & (gap - e > allowed_mm)
    return certain, ~told | (~certain & (gap + e > allowed_mm))


def exceeding(series: Series, allowed_mm: float) -> Exceeding:
    """The check of a series."""
    known = series.cases["gap_error_mm"].fillna(np.inf).to_numpy()
    gaps = series.cases["max_gap_mm"].to_numpy()
    e = known + ROUNDING * abs(gaps)
    exceeds, undecided = larger(allowed_mm, gaps, e)
    cases = series.cases.assign(e=e)[exceeds].sort_values("max_gap_mm", ascending=False, kind="stable")
    counts, largest = np.zeros(series.gaps.m), np.zeros(series.gaps.m)
    for block, some in series.of_cases(cases):
        counts += (some - block["e"].to_numpy()[:, None] > allowed_mm).sum(axis=0)
        largest = np.maximum(largest, some.max(axis=0))
    shares = counts / max(len(gaps), 1)
    return Exceeding(
        allowed_mm, len(gaps), cases, int(undecided.sum()), float(e.max(initial=0.0)), shares, largest
    )


def write(directory: Path, series: Series, found: Exceeding) -> None:
    """Write DIRECTORY/allowed-gap.csv, one row per contact, and allowed-gap.png if its places are known."""
    import pandas as pd
    from matplotlib.colors import Normalize

    from report.figures import style
    from report.figures.junction_maps import Map, Scale, drawn

    table = pd.DataFrame({"share_of_cases": found.shares, "largest_gap_mm": found.largest})
    if series.nodes is not None:
        table.insert(0, "x_mm", series.nodes[:, 0])
        table.insert(1, "y_mm", series.nodes[:, 1])
        percent = 100 * found.shares
        scale = Scale("share of cases, %", "magma_r", Normalize(0.0, float(percent.max()) or 1.0))
        title = f"cases with a gap of more than {found.allowed_mm:g} mm"
        with style.applied():
            drawing, _ = drawn([Map(title, series.nodes, percent, scale)], 1)
            drawing.savefig(directory / "allowed-gap.png", dpi=style.DPI)
    table.to_csv(directory / "allowed-gap.csv", index_label="contact")
