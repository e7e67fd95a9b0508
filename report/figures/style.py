"""One look for all figures, readable in greyscale and by colour-blind readers.

A solver keeps its colour and marker in every figure of every report; filled markers on solid lines are
the dual form, hollow ones on dashed lines the primal; variants differ in dashes, tint and
the part of the marker that is filled. Colours are those of Okabe and Ito (2008), without their yellow.
"""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

if TYPE_CHECKING:
    import pandas as pd  # slow to import, and not needed to draw

BLUE, VERMILLION, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
SKY, ORANGE, BLACK, GREY = "#56B4E9", "#E69F00", "#000000", "#7F7F7F"

WIDTH = 9.0  # inches; at 100 pixels an inch this is the width of a page of text on a screen
DPI = 160
COLUMNS = 4  # of a legend below a figure

KNOWN = {
    "ipm": (BLUE, "o"),
    "gi": (VERMILLION, "s"),
    "newton": (BLACK, "*"),
    "ipm-fast": (BLACK, "o"),
    "piqp": (GREEN, "D"),
    "proxqp": (PURPLE, "P"),
    "clarabel": (ORANGE, "X"),
    "osqp": (SKY, "p"),
    "daqp": (GREY, "h"),
    "quadprog": (GREEN, "<"),
    "highs": (PURPLE, ">"),
}
#: For solvers not named above: each pair differs from theirs. Open triangles are kept for unfinished runs.
SPARE = [(color, marker) for marker in "dvH8" for color in (BLACK, GREY, ORANGE, BLUE, VERMILLION, SKY)]
#: Marker size, tint (0: the full colour, 1: white), filled part of the marker and dashes of a solver's
#: first, second, … variant: the dual form's and the primal's.
VARIANTS: tuple[tuple[float, float, Literal["full", "bottom", "left", "top", "right"], Any, Any], ...] = (
    (6.5, 0.0, "full", "-", (0, (4, 2))),
    (6.5, 0.3, "bottom", (0, (1, 1.2)), (0, (2, 1, 1, 1))),
    (7.5, 0.0, "left", (0, (7, 1.5, 1, 1.5)), (0, (6, 2, 1, 2, 1, 2))),
    (5.5, 0.45, "top", (0, (3, 1, 1, 1, 1, 1)), (0, (1, 3))),
    (8.5, 0.3, "right", (0, (10, 2)), (0, (8, 4))),
)

RC: Any = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#444444",
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.7,
    "xtick.color": "#333333",
    "ytick.color": "#333333",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "hatch.linewidth": 0.6,
    "hatch.color": "#B5B5B5",
    "savefig.dpi": DPI,
    "figure.dpi": 100,
}


def applied() -> AbstractContextManager[None]:
    """The look, for the time of a `with` block: importing this module changes no global setting."""
    return mpl.rc_context(RC)


def figure(height: float) -> Figure:
    return Figure(figsize=(WIDTH, height), layout=ConstrainedLayoutEngine(w_pad=0.07, h_pad=0.07))


def figure_above(height: float, handles: list[Line2D]) -> Figure:
    """A figure of that height with its legend below it."""
    drawing = figure(height + 0.2 * math.ceil(len(handles) / COLUMNS))
    drawing.legend(handles=handles, loc="outside lower center", ncols=COLUMNS, handlelength=3.2)
    return drawing


def line_styles(cells: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """Keyword arguments of `Axes.plot` for each series of some cells: filled markers on solid lines for
    the dual form, hollow ones on dashed lines for the primal.
    """
    unknown = sorted(set(cells["solver"]) - set(KNOWN))
    looks = KNOWN | {solver: SPARE[i % len(SPARE)] for i, solver in enumerate(unknown)}
    styles: dict[str, dict[str, Any]] = {}
    for (solver, form), lines in cells.groupby(["solver", "form"]):
        full, marker = looks[solver]
        for i, series in enumerate(sorted(lines["series"].unique())):
            size, tint, filled, solid, dashed = VARIANTS[i % len(VARIANTS)]
            red, green, blue = (c + tint * (1 - c) for c in to_rgb(full))
            color = to_hex((red, green, blue))
            styles[series] = {
                "color": color,
                "marker": marker,
                "markersize": size,
                "markeredgecolor": color,
                "markerfacecolor": color if form == "dual" else "white",
                "markeredgewidth": 1.3,
                "fillstyle": filled,
                "markerfacecoloralt": "white",
                "linestyle": solid if form == "dual" else dashed,
                "linewidth": 1.6,
            }
    return styles


def line_only(style: dict[str, Any]) -> dict[str, Any]:
    return {**style, "marker": ""}


def marker_only(style: dict[str, Any]) -> dict[str, Any]:
    return {**style, "linestyle": ""}


def legend_entries(styles: dict[str, dict[str, Any]]) -> list[Line2D]:
    return [Line2D([], [], label=series, **look) for series, look in styles.items()]


def percent_above(axes: Axes, whole: float) -> None:
    """A second axis above the first, in % of `whole`."""
    there_and_back = (partial(np.multiply, 100 / whole), partial(np.multiply, whole / 100))
    axis = axes.secondary_xaxis("top", functions=there_and_back)
    axis.xaxis.set_major_formatter(lambda value, _: f"{value:g} %")
    axis.tick_params(length=3, labelsize=8)


def plain_log(axis: Axis) -> None:
    """A logarithmic axis with ticks at 0.1, 0.2, 0.5, 1, … where there is room, else at powers of ten."""
    low, high = axis.get_view_interval()
    subs = (1.0, 2.0, 5.0) if high / low < 2e3 else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs, numticks=20))
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_locator(NullLocator())
