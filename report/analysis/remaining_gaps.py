"""Statistics of the gaps that remain over the cases of a series.

The gaps are read in pieces. Quantiles are exact (numpy's, linear between order statistics) except for the
rounding of the gaps to float32, 6e-8 of their size.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from report.results.series import Array, Series

QUANTILES = (0.05, 0.5, 0.95, 0.99)
AT_ONCE = 2**22  # gaps read at a time
LEVELS = 200  # thresholds of the exceedance curve
CONFIDENCE = 0.95


def quantile_maps(series: Series) -> Array:
    """(len(QUANTILES) + 1, m), mm: the quantiles over the cases for each contact, and the mean."""
    numbers, m = series.cases["case"].to_numpy(), series.gaps.m
    maps = np.empty((len(QUANTILES) + 1, m))
    width = max(AT_ONCE // max(len(numbers), 1), 1)
    for start in range(0, m, width):
        some = series.gaps[numbers, start : start + width].astype(float)
        maps[:-1, start : start + width] = np.quantile(some, QUANTILES, axis=0)
        maps[-1, start : start + width] = some.mean(axis=0)
    return maps


def exceedance(series: Series) -> pd.DataFrame:
    """For gaps t in mm, the share of cases whose largest gap exceeds t, and the share of all contacts."""
    largest = np.sort(series.cases["max_gap_mm"].to_numpy())
    t = np.linspace(0.0, float(largest[-1]), LEVELS)
    numbers, m = series.cases["case"].to_numpy(), series.gaps.m
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
    """Quantiles of the largest gap per case over the first N cases, with a distribution-free interval.

    The interval lies between the order statistics whose ranks contain the quantile with 95 % probability
    (binomial), if there are enough cases for it. It assumes that the cases are drawn independently.
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
