"""In how many cases of a series the remaining gap is larger than allowed, and at which contacts.

A gap y is known up to an e (harness/verification/assess.py). It is larger than allowed if y − e is, and
not if y + e is not; between the two nothing can be said, nor of an allowed gap below e. A case is judged by
its largest gap and its gap_error_mm; it is undecided if its row does not say how well its gaps are known.
The gaps of the contacts are stored as float32, whose rounding, 6e-8 of the gap, is added.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from report.figures import style
from report.figures.maps import Map, Scale, drawn
from report.results.series import Array, Series

Flags = NDArray[np.bool_]
ROUNDING = 2.0**-24


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
    shares: Array
    largest: Array


def larger(allowed_mm: float, gap: Array, e: Array) -> tuple[Flags, Flags]:
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


def write(directory: Path, series: Series, found: Exceeding) -> Path:
    """Write DIRECTORY/allowed-gap.csv, one row per contact, and allowed-gap.png if its places are known."""
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
    path = directory / "allowed-gap.csv"
    table.to_csv(path, index_label="contact")
    return path
