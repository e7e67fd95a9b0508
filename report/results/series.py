"""The report of a series: statistics, tables and pictures of the gaps that are left, from DIRECTORY alone.

Rows and gaps are read in pieces, so that memory does not grow with the number of cases but for a few
figures a case. Quantiles are exact (numpy's, linear between order statistics) but for the float32 in which
the gaps are kept, 6e-8 of their size.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]

FIGURES = ("max_gap_mm", "mean_gap_mm", "bound_mm", "displacement_error_mm", "setup_s", "solve_s", "form_s")
QUANTILES = (0.05, 0.5, 0.95, 0.99)
AT_ONCE = 2**22  # gaps read at a time
LEVELS = 200  # thresholds of the exceedance curve
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Series:
    """What a directory holds. cases : those with an answer, ascending; gaps : (cases, m) on disk, mm."""

    facts: dict[str, Any]
    counts: dict[str, int]
    cases: pd.DataFrame
    gaps: NDArray[np.float32]
    nodes: Array | None
    fasteners: Array
    swept: list[str]


def read(directory: Path) -> Series:
    """Raises FileNotFoundError where the directory has no series."""
    facts = json.loads((directory / "series.json").read_text("utf-8"))
    counts: dict[str, int] = {}
    kept: list[tuple[Any, ...]] = []
    swept: list[str] = []
    for row in _rows(directory / "cases.jsonl"):
        counts[row["verdict"]] = counts.get(row["verdict"], 0) + 1
        if row["case"] >= facts["cases"] or row.get("max_gap_mm") is None:
            continue
        swept = swept or [key for key in row if "." in key]
        kept.append((row["case"], *(row.get(name) for name in FIGURES), *(row[key] for key in swept)))
    cases = pd.DataFrame(kept, columns=["case", *FIGURES, *swept], dtype=float)
    cases = cases.astype({"case": int}).sort_values("case").reset_index(drop=True)
    with np.load(directory / "contacts.npz") as arrays:
        m = int(arrays["m"])
        nodes = arrays.get("contact_nodes")
        fasteners = arrays.get("fasteners", np.zeros((0, 2)))
    path = directory / "gaps.f4"
    stored = path.stat().st_size // (4 * m) if path.exists() else 0
    gaps = np.memmap(path, np.float32, "r", shape=(stored, m)) if stored else np.zeros((0, m), np.float32)
    return Series(facts, counts, cases, gaps, nodes, fasteners, swept)


def _rows(path: Path) -> Iterator[dict[str, Any]]:
    if not path.exists():
        return
    with path.open("rb") as file:
        for line in file:
            if line.endswith(b"\n"):
                yield json.loads(line)


def quantile_maps(series: Series) -> Array:
    """(len(QUANTILES) + 1, m) mm: the quantiles over the cases, contact by contact, and the mean."""
    numbers, m = series.cases["case"].to_numpy(), series.gaps.shape[1]
    maps = np.empty((len(QUANTILES) + 1, m))
    width = max(AT_ONCE // max(len(numbers), 1), 1)
    for start in range(0, m, width):
        some = series.gaps[numbers, start : start + width].astype(float)
        maps[:-1, start : start + width] = np.quantile(some, QUANTILES, axis=0)
        maps[-1, start : start + width] = some.mean(axis=0)
    return maps


def exceedance(series: Series) -> pd.DataFrame:
    """For gaps t in mm, the share of the cases whose largest gap exceeds t, and of all their contacts."""
    largest = np.sort(series.cases["max_gap_mm"].to_numpy())
    t = np.linspace(0.0, float(largest[-1]), LEVELS)
    numbers, m = series.cases["case"].to_numpy(), series.gaps.shape[1]
    above = np.zeros(LEVELS)
    rows = max(AT_ONCE // m, 1)
    for start in range(0, len(numbers), rows):
        some = np.sort(series.gaps[numbers[start : start + rows]].ravel())
        above += some.size - np.searchsorted(some, t.astype(np.float32), side="right")
    cases = 1 - np.searchsorted(largest, t, side="right") / len(largest)
    return pd.DataFrame(
        {"gap_mm": t, "share_of_cases": cases, "share_of_contacts": above / (len(numbers) * m)}
    )


def convergence(series: Series) -> pd.DataFrame:
    """Quantiles of the largest gap of a case over the first N cases, with a distribution-free interval.

    The interval runs between the order statistics whose ranks hold the quantile with 95 % probability
    (binomial), where there are enough cases for it; it presumes cases drawn independently.
    """
    from scipy.stats import binom

    largest = series.cases["max_gap_mm"].to_numpy()
    counts = np.unique(np.geomspace(min(10, len(largest)), len(largest), 25).astype(int))
    found = []
    for count in counts:
        values = np.sort(largest[:count])
        for q in QUANTILES[1:]:
            low, high = (int(rank) for rank in binom.interval(CONFIDENCE, count, q))
            enough = low >= 1 and high < count
            interval = (values[low - 1], values[high]) if enough else (np.nan, np.nan)
            found.append((count, q, np.quantile(values, q), *interval))
    return pd.DataFrame(found, columns=["cases", "quantile", "gap_mm", "low_mm", "high_mm"])
