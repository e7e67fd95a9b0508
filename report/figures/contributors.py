"""The share of the variance of the largest gap y that each random input x of a series contributes.

    first order  V(E(y | x)) / V(y),    total  E(V(y | all but x)) / V(y)

scipy.stats.sobol_indices estimates these Sobol indices (Saltelli et al., Comput. Phys. Commun. 181:259–270,
2010); quantiles of a bootstrap are their 95 % intervals.
"""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Drawing

from report.results.series_results import Series

from . import style

ORDERS = {"first_order": style.BLUE, "total_order": style.VERMILLION}
ENDS, RESAMPLES = (0.025, 0.975), 999


def indices(series: Series) -> pd.DataFrame:
    """A row per input; none unless these are cases for contributors and all are answered."""
    from scipy.stats import sobol_indices  # slow to import

    cases, facts = series.cases, series.facts
    if (per_point := facts.get("cases_per_point", 1)) == 1 or len(cases) < facts["cases"]:
        return pd.DataFrame()
    y = cases["max_gap_mm"].to_numpy()
    f = y.reshape(-1, 1, per_point).T * (np.ptp(y) > 2 * cases["gap_error_mm"].max())
    N, random, table = f.shape[-1], np.random.default_rng(0), pd.DataFrame({"input": facts["random_inputs"]})
    picked = (random.integers(N, size=N) if k else np.arange(N) for k in range(RESAMPLES + 1))
    parts = ({"f_A": f[0][:, i], "f_B": f[1][:, i], "f_AB": f[2:, :, i]} for i in picked)
    made = (sobol_indices(func=part, n=N) for part in parts)
    estimates = np.array([(one.first_order, one.total_order) for one in made])
    low, high = np.quantile(estimates[1:], ENDS, axis=0)
    for k, order in enumerate(ORDERS):
        table[order], table[f"{order}_low"], table[f"{order}_high"] = estimates[0, k], low[k], high[k]
    return table


def bars(table: pd.DataFrame) -> Drawing:
    """Both indices of each input, with their intervals."""
    share, drawing = 100 * table.set_index("input")[::-1], style.figure(1.3 + 0.4 * len(table))
    ends = [[share[order] - share[f"{order}_low"], share[f"{order}_high"] - share[order]] for order in ORDERS]
    look: dict[str, Any] = {"ylabel": "", "color": [*ORDERS.values()], "legend": False}
    axes = share[[*ORDERS]].plot.barh(ax=drawing.subplots(), xerr=abs(np.array(ends)), **look)
    axes.set(xlabel="share of the variance, %")
    drawing.legend(labels=["first order", "total"], loc="outside upper center", ncols=2)
    return drawing
