"""Statistics of the gaps that remain over the cases of a series.

The gaps are read in pieces. Quantiles are exact (numpy's, linear between order statistics) except for the
rounding of the gaps to float32, 6e-8 of their size.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from report.results.series import Array, Series

QUANTILES = (0.05, 0.5, 0.95, 0.99)
LEVELS = 200  # thresholds of the exceedance curve
CONFIDENCE = 0.95


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
