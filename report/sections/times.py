"""Time against the number of active contacts: the paper's Figures 5 to 7 in shape."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation

from .. import style
from ..blocks import Figure, Section
from ..labels import in_order
from ..numbers import significant
from ..rows import ANSWERED, Results

PANEL = 3.0  # inches
BESIDE = 5.5  # points between the marks of several unfinished runs of a scene


def section(results: Results) -> Section | None:
    cells = results.tightest
    cells = cells[cells.groupby("n")["active"].transform("nunique") > 1]
    if cells["load_case_s"].notna().sum() == 0:
        return None
    sizes = sorted(cells["n"].unique())
    order, styles = in_order(cells, "series"), style.line_styles(results.cells)
    drawing = style.figure(PANEL * len(sizes) + 0.3)
    for axes, n in zip(drawing.subplots(len(sizes), 1, squeeze=False)[:, 0], sizes, strict=True):
        _panel(axes, cells[cells["n"] == n], order, styles)
    axes.set_xlabel("active contacts")
    handles = [*style.legend_entries(order, styles), *_notes(cells)]
    drawing.legend(handles=handles, loc="outside right upper", handlelength=3.2)
    several = (
        " Of several tolerances, the tightest."
        if results.cells["series"].nunique() < results.cells["label"].nunique()
        else ""
    )
    caption = (
        "*Seconds a load case (set-up + solve + the dual form's own cost) against the active contacts*, "
        f"below in number, above in % of m.{several} Solid and filled: dual form; dashed and hollow: primal. "
        f"Crossed out: answered, but not within {results.limit}. Open triangles, in the solver's colour, "
        "stand at the time limit of runs that did not finish; crosses at the upper edge, for runs that gave "
        "no answer for another reason."
    )
    return Section("Time against active contacts", [Figure("time-active", caption, drawing)])


def _panel(axes: Axes, cells: pd.DataFrame, order: list[str], styles: dict[str, dict[str, Any]]) -> None:
    for series in order:
        line = cells[(cells["series"] == series) & cells["load_case_s"].notna()].sort_values("active")
        axes.plot(line["active"], line["load_case_s"], **styles[series])
        outside = line[line["verdict"] != "within"]
        axes.plot(outside["active"], outside["load_case_s"], "x", color="black", markersize=6.5, zorder=3)
    axes.set_yscale("log")
    axes.margins(x=0.07, y=0.08)
    missed = cells[~cells["verdict"].isin(ANSWERED)]
    missed = missed.assign(place=missed["series"].map(order.index)).sort_values("place")
    late = missed[(missed["status"] == "time_limit") & missed["time_limit_s"].notna()]
    for limit in late["time_limit_s"].unique():
        axes.axhline(limit, color="#AAAAAA", linewidth=0.8, zorder=0.5)
        axes.annotate(
            f"limit {significant(limit, 2)} s", (1, limit), (3, 0), xycoords=("axes fraction", "data"),
            textcoords="offset points", va="center", fontsize=7.5, color="#666666",
        )  # fmt: skip
    if len(missed):
        low, high = axes.get_ylim()
        axes.set_ylim(low, high * (high / low) ** 0.08)
    for _, scene in late.groupby("active"):
        _beside(axes, scene, styles, "^")
    for _, scene in missed.drop(late.index).groupby("active"):
        _beside(axes, scene, styles, "x")
    axes.set_ylabel("time a load case, s")
    style.plain_log(axes.yaxis)
    n, m = cells["n"].iloc[0], cells["m"].iloc[0]
    axes.set_title(f"n = {n:.0f}" + (f", m = {m:.0f}" if m > 0 else ""), pad=5)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    if m > 0:
        percent = axes.secondary_xaxis(
            "top", functions=(partial(np.multiply, 100 / m), partial(np.multiply, m / 100))
        )
        percent.xaxis.set_major_formatter(lambda value, _: f"{value:g} %")
        percent.tick_params(length=3, labelsize=8)


def _beside(axes: Axes, runs: pd.DataFrame, styles: dict[str, dict[str, Any]], marker: str) -> None:
    """Marks of the unfinished runs of one scene side by side: at their time limit, or at the upper edge."""
    along = axes.transData if marker == "^" else axes.get_xaxis_transform()
    heights = runs["time_limit_s"] if marker == "^" else [0.97] * len(runs)
    for i, (series, x, y) in enumerate(zip(runs["series"], runs["active"], heights, strict=True)):
        inches = BESIDE * (i - (len(runs) - 1) / 2) / 72
        shift = ScaledTranslation(inches, 0, axes.figure.dpi_scale_trans)
        look: dict[str, Any] = {
            "marker": marker,
            "markersize": 6,
            "linestyle": "",
            "markerfacecolor": "none",
            "zorder": 4,
        }
        axes.plot([x], [y], color=styles[series]["color"], transform=along + shift, **look)


def _notes(cells: pd.DataFrame) -> list[Line2D]:
    """Legend entries for those of the marks that occur."""
    missed = ~cells["verdict"].isin(ANSWERED)
    late = missed & (cells["status"] == "time_limit")
    notes = [
        (cells["verdict"].isin(ANSWERED[1:]), "not within the limit", "x", "black"),
        (late, "not finished in time", "^", style.GREY),
        (missed & ~late, "no answer", "x", style.GREY),
    ]
    return [
        Line2D([], [], label=text, marker=marker, color=color, markerfacecolor="none", linestyle="")
        for present, text, marker, color in notes
        if np.any(present)
    ]
