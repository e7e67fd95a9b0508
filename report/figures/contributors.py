"""The share of the variance of a figure y that each random input x of a series contributes: of the largest
gap and force and of the force in each fastener, with intervals, and of the gap at each contact.

    first order  V(E(y | x)) / V(y),    total  E(V(y | all but x)) / V(y)

scipy.stats.sobol_indices estimates these Sobol indices (Saltelli et al., Comput. Phys. Commun. 181:259–270,
2010); quantiles of a bootstrap are their 95 % intervals.
"""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import Normalize
from matplotlib.figure import Figure as Drawing

from report.results.series_results import AT_ONCE, Array, Series

from . import style
from .junction_maps import Map, Scale, map_sheet

ORDERS = {"first_order": style.BLUE, "total_order": style.VERMILLION}
ENDS, RESAMPLES = (0.025, 0.975), 999


def indices(series: Series, y: Array, error: float) -> pd.DataFrame:
    """A row per input, of y (cases,), which is known up to an error; NaN if one case has none."""
    f, random = _answers(series, y[:, None], error)[:, 0], np.random.default_rng(0)
    N, table = f.shape[-1], pd.DataFrame({"input": series.facts["random_inputs"]})
    picked = np.vstack([np.arange(N), random.integers(N, size=(RESAMPLES, N))])
    pieces = np.array_split(picked, -(-picked.size * len(f) // AT_ONCE))
    estimates = np.concatenate([_estimated(f[:, some]) for some in pieces], axis=2)
    low, high = np.quantile(estimates[:, :, 1:], ENDS, axis=2)
    for k, order in enumerate(ORDERS):
        table[order], table[f"{order}_low"], table[f"{order}_high"] = estimates[k, :, 0], low[k], high[k]
    return table


def of_contacts(series: Series) -> Array:
    """(2, d, m): both indices of each of d inputs for the gap at each contact; 0 where it does not vary, NaN
    where a few cases make its variance v, so that v's own standard error is more than v / 3.
    """
    error, pieces = series.cases["gap_error_mm"].max(skipna=False), []
    for gaps in series.of_contacts():
        f = _answers(series, gaps, error)
        squares = (f - f.mean(axis=(0, 2), keepdims=True)) ** 2
        error_of_v = squares.std(axis=(0, 2)) / np.sqrt(2 * f.shape[-1])  # A and B are independent
        few = (squares.mean(axis=(0, 2)) <= 3.0 * error_of_v) & (error_of_v > 0.0)
        pieces.append(np.where(few, np.nan, _estimated(f)))
    return np.concatenate(pieces, axis=2)


def of_forces(series: Series) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The rows of the largest force, and these with those of each fastener."""
    error, places = series.cases["force_error_N"].max(skipna=False), series.facts["fasteners"]
    varying = series.forces[:, ~(np.ptp(series.forces, axis=0) == 0)]  # not those of clamps
    largest = indices(series, abs(varying).max(axis=1, initial=0.0), error)
    pairs = zip(places, series.forces.T, strict=True)
    each = [indices(series, y, error).assign(**{k: at[k] for k in ("kind", "x", "y")}) for at, y in pairs]
    return largest, pd.concat([largest.assign(kind="largest"), *each])


def _estimated(f: Array) -> Array:
    """(2, d, s): both indices of d inputs, of s figures, by f (d + 2, s, N) of `_answers`."""
    from scipy.stats import sobol_indices  # slow to import

    made = sobol_indices(func={"f_A": f[0], "f_B": f[1], "f_AB": f[2:]}, n=f.shape[-1])
    return np.array([order.reshape(-1, len(f) - 2).T for order in (made.first_order, made.total_order)])


def _answers(series: Series, y: Array, error: float) -> Array:
    """(d + 2, s, N) of y (cases, s): at A, B, and A with one column of B each; 0 where y is known to be
    constant.
    """
    varies = ~(np.ptp(y, axis=0) <= 2 * error)  # to what is known: with no error nothing is constant
    return (y * varies).reshape(-1, series.facts["cases_per_point"], y.shape[1]).transpose(1, 2, 0)


def maps(series: Series, nodes: Array) -> tuple[Drawing, pd.DataFrame]:
    """The total index of each input for the gap at each contact, and a table of both."""
    names, shares = series.facts["random_inputs"], of_contacts(series)
    scale = Scale("share of the variance, total", "viridis", Normalize(0.0, 1.0))
    pairs = zip(names, shares[1], strict=True)
    shown = [Map(name, nodes, share, scale, (), series.marks) for name, share in pairs]
    columns = ["x_mm", "y_mm", *(f"{name}, {order}" for order in ORDERS for name in names)]
    return map_sheet(shown, 3)[0], pd.DataFrame(np.vstack([nodes[:, :2].T, *shares]).T, columns=columns)


def bars(table: pd.DataFrame) -> Drawing:
    """Both indices of each input, with their intervals."""
    share, drawing = 100 * table.set_index("input")[::-1], style.figure(1.3 + 0.4 * len(table))
    ends = [[share[order] - share[f"{order}_low"], share[f"{order}_high"] - share[order]] for order in ORDERS]
    look: dict[str, Any] = {"ylabel": "", "color": [*ORDERS.values()], "legend": False}
    axes = share[[*ORDERS]].plot.barh(ax=drawing.subplots(), xerr=abs(np.array(ends)), **look)
    axes.set(xlabel="share of the variance, %")
    drawing.legend(labels=["first order", "total"], loc="outside upper center", ncols=2)
    return drawing
