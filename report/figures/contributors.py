"""The share of the variance of a gap y that each random input x of a series contributes: of the largest gap
per case, with intervals, and of the gap at each contact.

    first order  V(E(y | x)) / V(y),    total  E(V(y | all but x)) / V(y)

scipy.stats.sobol_indices estimates these Sobol indices (Saltelli et al., Comput. Phys. Commun. 181:259–270,
2010); quantiles of a bootstrap are their 95 % intervals.
"""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import Normalize
from matplotlib.figure import Figure as Drawing

from report.results.series_results import Array, Series

from . import style
from .junction_maps import Map, Scale, drawn

ORDERS = {"first_order": style.BLUE, "total_order": style.VERMILLION}
ENDS, RESAMPLES = (0.025, 0.975), 999


def indices(series: Series) -> pd.DataFrame:
    """A row per input; none unless these are cases for contributors and all are answered."""
    from scipy.stats import sobol_indices  # slow to import

    if series.facts.get("cases_per_point", 1) == 1 or len(series.cases) < series.facts["cases"]:
        return pd.DataFrame()
    f, random = _answers(series, series.cases[["max_gap_mm"]].to_numpy()), np.random.default_rng(0)
    N, table = f.shape[-1], pd.DataFrame({"input": series.facts["random_inputs"]})
    picked = (random.integers(N, size=N) if k else np.arange(N) for k in range(RESAMPLES + 1))
    parts = ({"f_A": f[0][:, i], "f_B": f[1][:, i], "f_AB": f[2:, :, i]} for i in picked)
    made = (sobol_indices(func=part, n=N) for part in parts)
    estimates = np.array([(one.first_order, one.total_order) for one in made])
    low, high = np.quantile(estimates[1:], ENDS, axis=0)
    for k, order in enumerate(ORDERS):
        table[order], table[f"{order}_low"], table[f"{order}_high"] = estimates[0, k], low[k], high[k]
    return table


def of_contacts(series: Series) -> Array:
    """(2, d, m): both indices of each of d inputs for the gap at each contact; 0 where it does not vary."""
    from scipy.stats import sobol_indices

    pieces = []
    for gaps in series.of_contacts():
        f = _answers(series, gaps)
        made = sobol_indices(func={"f_A": f[0], "f_B": f[1], "f_AB": f[2:]}, n=f.shape[-1])
        pieces.append([order.reshape(-1, len(f) - 2).T for order in (made.first_order, made.total_order)])
    return np.concatenate(pieces, axis=2)


def _answers(series: Series, y: Array) -> Array:
    """(d + 2, s, N) of y (cases, s), mm: at A, B, and A with one column of B each; 0 where y is constant."""
    varies = np.ptp(y, axis=0) > 2 * series.cases["gap_error_mm"].max()
    return (y * varies).reshape(-1, series.facts["cases_per_point"], y.shape[1]).transpose(1, 2, 0)


def maps(series: Series, nodes: Array) -> tuple[Drawing, pd.DataFrame]:
    """The total index of each input for the gap at each contact, and a table of both."""
    names, shares = series.facts["random_inputs"], of_contacts(series)
    scale = Scale("share of the variance, total", "viridis", Normalize(0.0, 1.0))
    pairs = zip(names, shares[1], strict=True)
    shown = [Map(name, nodes, share, scale, (), series.marks) for name, share in pairs]
    columns = ["x_mm", "y_mm", *(f"{name}, {order}" for order in ORDERS for name in names)]
    return drawn(shown, 3)[0], pd.DataFrame(np.vstack([nodes[:, :2].T, *shares]).T, columns=columns)


def bars(table: pd.DataFrame) -> Drawing:
    """Both indices of each input, with their intervals."""
    share, drawing = 100 * table.set_index("input")[::-1], style.figure(1.3 + 0.4 * len(table))
    ends = [[share[order] - share[f"{order}_low"], share[f"{order}_high"] - share[order]] for order in ORDERS]
    look: dict[str, Any] = {"ylabel": "", "color": [*ORDERS.values()], "legend": False}
    axes = share[[*ORDERS]].plot.barh(ax=drawing.subplots(), xerr=abs(np.array(ends)), **look)
    axes.set(xlabel="share of the variance, %")
    drawing.legend(labels=["first order", "total"], loc="outside upper center", ncols=2)
    return drawing
