"""The directory of a series of load cases, read, and statistics of the gaps that remain.

The gaps stay on disk and are read in pieces, so that memory grows with the number of cases only by a few
figures per case. Quantiles are exact (numpy's, linear between order statistics) except for the rounding of
the gaps to float32, 6e-8 of their size.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from harness.results import series_file
from report.document.escape import quoted

Array = NDArray[np.float64]
AT_ONCE = 2**22  # gaps read at a time

FIGURES = (
    *("max_gap_mm", "mean_gap_mm", "gap_error_mm", "bound_mm", "displacement_error_mm"),
    *("setup_s", "solve_s", "form_s", "force_error_N"),
)
QUANTILES = (0.05, 0.5, 0.95, 0.99)
LEVELS = 200  # thresholds of the exceedance curve
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Series:
    """A series. cases : the answered ones, in order; gaps : (cases, m), mm, on disk; code : the `commit` of
    each case, and whether it was `clean`; forces : (cases, r), N, in fasteners, none without springs.
    """

    facts: dict[str, Any]
    counts: dict[str, int]
    cases: pd.DataFrame
    gaps: series_file.StoredGaps
    nodes: Array | None
    fasteners: Array
    swept: list[str]
    code: pd.DataFrame
    forces: Array

    @property
    def marks(self) -> dict[str, list[list[float]]]:
        """The fasteners for a map of the junction."""
        return {"fasteners": self.fasteners.tolist()} if len(self.fasteners) else {}

    @property
    def worst_case(self) -> int:
        """The number of the case with the largest gap."""
        return int(self.cases["case"].iloc[self.cases["max_gap_mm"].to_numpy().argmax()])

    @property
    def independent(self) -> "Series":
        """The independent cases alone: of those for contributors, two of each base point."""
        per_point = self.facts.get("cases_per_point", 1)
        return replace(self, cases=self.cases[self.cases["case"] % per_point < 2]) if per_point > 1 else self

    def of_contacts(self, step: int = 1) -> Iterator[Array]:
        """The gaps of every step-th contact in pieces: (cases, some contacts), mm."""
        numbers = self.cases["case"].to_numpy()
        width = max(AT_ONCE // max(len(numbers), 1), 1) * step
        for start in range(0, self.gaps.m, width):
            yield self.gaps[numbers, start : min(start + width, self.gaps.m) : step].astype(float)

    def of_cases(self, cases: pd.DataFrame) -> Iterator[tuple[pd.DataFrame, Array]]:
        """Some of the cases in pieces, with their gaps: (some cases, m), mm."""
        rows = max(AT_ONCE // max(self.gaps.m, 1), 1)
        for start in range(0, len(cases), rows):
            block = cases.iloc[start : start + rows]
            yield block, self.gaps[block["case"].to_numpy()].astype(float)


def allowed_mm(facts: dict[str, Any]) -> float:
    """The allowed gap of a series or an answer, mm; infinite without one."""
    return float((facts.get("allowed_gap") or {}).get("allowed_mm", np.inf))


def read(directory: Path) -> Series:
    """Read a directory. Raises InputError if its file is damaged."""
    facts = quoted(series_file.read_facts(directory))
    verdicts: Counter[str] = Counter()
    swept: list[str] = []
    code: list[list[str | bool | None]] = []
    kept: list[tuple[Any, ...]] = []
    forces: list[list[float]] = []
    for row in series_file.rows(directory):
        verdicts[row["verdict"]] += 1
        code.append([row.get("commit") or "", row.get("clean")])
        if row.get("max_gap_mm") is not None:
            swept = swept or [key for key in row if "." in key and not facts.get("random_inputs")]
            figures = (row.get(name) for name in FIGURES)
            kept.append((row["case"], *figures, *(row[key] for key in swept)))
            forces.append(row.get("fastener_forces_N", []))
    swept = quoted(swept)
    cases = pd.DataFrame(kept, columns=["case", *FIGURES, *swept], dtype=float).astype({"case": int})
    contacts = series_file.read_contacts(directory)
    nodes, fasteners = contacts.get("contact_nodes"), contacts.get("fasteners", np.zeros((0, 2)))
    gaps = series_file.StoredGaps(directory, int(contacts["m"]))
    made = pd.DataFrame(quoted(code), columns=["commit", "clean"])
    tension = np.array(forces, dtype=float).reshape(len(forces), len(forces[0]) if forces else 0)
    return Series(facts, quoted(verdicts), cases, gaps, nodes, fasteners, swept, made, tension)


def quantile_maps(series: Series) -> Array:
    """(len(QUANTILES) + 1, m), mm: the quantiles over the cases for each contact, and the mean."""
    pieces = [np.vstack([np.quantile(s, QUANTILES, axis=0), s.mean(axis=0)]) for s in series.of_contacts()]
    return np.hstack(pieces)


def exceedance(series: Series) -> pd.DataFrame:
    """For gaps t in mm, the share of cases whose largest gap exceeds t, and the share of all contacts."""
    largest = np.sort(series.cases["max_gap_mm"].to_numpy())
    t = np.linspace(0.0, float(largest[-1]), LEVELS)
    above = np.zeros(LEVELS)
    for _, gaps in series.of_cases(series.cases):
        some = np.sort(gaps.ravel())
        above += some.size - np.searchsorted(some, t.astype(np.float32), side="right")
    cases = 1 - np.searchsorted(largest, t, side="right") / len(largest)
    contacts = above / (len(largest) * series.gaps.m)
    return pd.DataFrame({"gap_mm": t, "share_of_cases": cases, "share_of_contacts": contacts})


def convergence(series: Series) -> pd.DataFrame:
    """Quantiles of the largest gap per case over the first N cases, with a distribution-free interval.

    The interval lies between the order statistics whose ranks contain the quantile with 95 % probability
    (binomial), if there are enough cases for it. It assumes that the cases are drawn independently.
    """
    from scipy.stats import binom

    largest = series.independent.cases["max_gap_mm"].to_numpy()
    counts = np.unique(np.geomspace(min(10, len(largest)), len(largest), 25).astype(int))
    lines = []
    for count in counts:
        values = np.sort(largest[:count])
        for q in QUANTILES[1:]:
            low, high = (int(rank) for rank in binom.interval(CONFIDENCE, count, q))
            enough = low >= 1 and high < count
            interval = (values[low - 1], values[high]) if enough else (np.nan, np.nan)
            lines.append((count, q, np.quantile(values, q), *interval))
    return pd.DataFrame(lines, columns=["cases", "quantile", "gap_mm", "low_mm", "high_mm"])
