"""The marks of runs without an answer, the same in every figure of times."""

from __future__ import annotations

from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from harness.results.schema import ANSWERED
from report.document.numbers import significant

from . import style

BESIDE = 5.5  # points between marks that would coincide
HOLLOW: dict[str, Any] = {"linestyle": "", "markersize": 6, "markerfacecolor": "none", "zorder": 4}


def unfinished(
    axes: Axes, cells: pd.DataFrame, x: str, styles: dict[str, dict[str, Any]], *, inside: bool = False
) -> None:
    """On a logarithmic axis of seconds, open triangles in the colour of their method for runs stopped at the
    time limit, and crosses at the upper edge for runs without an answer for another reason.

    x : the column of their places along the axis; marks at one place stand side by side. The limit is named
    to the right of the axes, or if `inside`, within them on the left.
    """
    missed = cells[~cells["verdict"].isin(ANSWERED)]
    if missed.empty:
        return
    order = list(styles)
    missed = missed.assign(order=missed["method"].map(order.index)).sort_values("order")
    late = missed[(missed["status"] == "time_limit") & missed["time_limit_s"].notna()]
    for limit in late["time_limit_s"].unique():
        axes.axhline(limit, color="#AAAAAA", linewidth=0.8, zorder=0.5)
        axes.annotate(
            f"limit {significant(limit, 2)} s", (0 if inside else 1, limit), (3, 1.5 if inside else 0),
            xycoords=("axes fraction", "data"), textcoords="offset points",
            va="bottom" if inside else "center", fontsize=7.5, color="#666666",
        )  # fmt: skip
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.08)
    for _, place in late.groupby(x):
        _beside(axes, place[x], place["time_limit_s"], place["method"], styles, "^")
    for _, place in missed.drop(late.index).groupby(x):
        _beside(axes, place[x], 0.97, place["method"], styles, "x")


def _beside(
    axes: Axes, xs: pd.Series[float], heights: Any, method: pd.Series[str],
    styles: dict[str, dict[str, Any]], marker: str,
) -> None:  # fmt: skip
    along = axes.transData if marker == "^" else axes.get_xaxis_transform()
    table = pd.DataFrame({"x": xs, "y": heights, "method": method})
    for i, (x, y, name) in enumerate(table.itertuples(index=False)):
        inches = BESIDE * (i - (len(table) - 1) / 2) / 72
        shift = ScaledTranslation(inches, 0, axes.figure.dpi_scale_trans)
        axes.plot([x], [y], marker=marker, color=styles[name]["color"], transform=along + shift, **HOLLOW)


def entries(cells: pd.DataFrame) -> list[Line2D]:
    """Legend entries for the marks that occur."""
    missed = ~cells["verdict"].isin(ANSWERED)
    late = missed & (cells["status"] == "time_limit")
    notes = [(late, "not finished in time", "^"), (missed & ~late, "no answer", "x")]
    look = HOLLOW | {"color": style.GREY}
    return [Line2D([], [], label=text, marker=mark, **look) for here, text, mark in notes if here.any()]
