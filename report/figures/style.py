"""One look for all figures, readable in greyscale and by colour-blind readers.

A solver keeps its colour and marker in every figure of every report: a fixed pair, or one that follows from
its name. Its forms differ in dashes and in the face of the marker, its variants in tint and the filled part
of the marker. The colours are those of Okabe and Ito (2008), without their yellow, and some more. The fixed
colours of our solvers are told apart without markers, also by colour-blind readers.
"""

from __future__ import annotations

import math
import warnings
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
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
ROSE, INDIGO, BROWN, PINK = "#AA4466", "#332288", "#661100", "#FA9FB5"
MUSTARD = "#B2B259"

WIDTH = 9.0  # inches; at 100 pixels per inch the width of a page of text on a screen
DPI = 160
COLUMNS = 4  # of a legend below a figure
ENTRY = 0.21  # inches: a line of a legend beside panels

#: Colour and marker of the solvers for which they were chosen. Any other solver needs no entry: see `looks`.
FIXED = {
    "ipm": (BLUE, "o"),
    "gi": (VERMILLION, "s"),
    "newton": (BLACK, "*"),
    "ipm-fast": (ROSE, "o"),
    "mprgp": (INDIGO, "v"),
    "nnls": (BROWN, "d"),
    "l-bfgs-b": (PINK, "H"),
    "projected-gauss-seidel": (SKY, "8"),
    "textbook-active-set": (MUSTARD, "<"),
    "piqp": (GREEN, "D"),
    "proxqp": (PURPLE, "P"),
    "clarabel": (ORANGE, "X"),
    "osqp": (SKY, "p"),
    "daqp": (GREY, "h"),
    "quadprog": (GREEN, "<"),
    "highs": (PURPLE, ">"),
}
#: The pairs of all other solvers. Open triangles mark unfinished runs, and black is newton's alone.
SPARE = [
    (color, marker)
    for marker in "dvH8oshpDPX<>"
    for color in (GREY, BLUE, ORANGE, VERMILLION, SKY, GREEN, PURPLE, ROSE, INDIGO, BROWN)
    if (color, marker) not in FIXED.values()
]
#: Marker size and filled part of the marker of a solver's first, second, … variant of a form, over and over.
VARIANTS: tuple[tuple[float, Literal["full", "bottom", "left", "top", "right"]], ...] = (
    (6.5, "full"),
    (6.5, "bottom"),
    (7.5, "left"),
    (5.5, "top"),
    (8.5, "right"),
)
PALEST = 0.65  # the tint of the last variant (0: the full colour, as of the first; 1: white)
#: By form its dashes, and the tint of the marker's face: filled, hollow, pale. An unknown form looks like the
#: last.
LOOKS: dict[str, tuple[Any, float]] = {
    "dual": ("-", 0.0),
    "primal": ((0, (4, 2)), 1.0),
    "sparse": ((0, (6, 1.5, 1.5, 1.5)), 0.65),
}
#: The same in words, for captions.
FORMS = {
    "dual": "solid and filled: dual form",
    "primal": "dashed and hollow: primal form",
    "sparse": "dash-dotted and pale: sparse form",
}

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


@contextmanager
def applied() -> Iterator[None]:
    """The style within a `with` block, where a letter that the font lacks is a box without a warning:
    importing this module changes no global setting.
    """
    with mpl.rc_context(RC), warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from font")
        yield


def figure(height: float) -> Figure:
    return Figure(figsize=(WIDTH, height), layout=ConstrainedLayoutEngine(w_pad=0.07, h_pad=0.07))


def single(height: float) -> tuple[Figure, Axes]:
    """A figure of that height with one pair of axes."""
    drawing = figure(height)
    return drawing, drawing.subplots()


def figure_above(height: float, handles: list[Line2D]) -> Figure:
    """A figure of that height with its legend below it."""
    drawing = figure(height + 0.2 * math.ceil(len(handles) / COLUMNS))
    drawing.legend(handles=handles, loc="outside lower center", ncols=COLUMNS, handlelength=3.2)
    return drawing


def panels(
    count: int, height: float, handles: list[Line2D], sharex: bool = False
) -> tuple[Figure, list[Axes]]:
    """Panels of that height, or as high as the legend beside them, one below the other."""
    drawing = figure(max(height * count, ENTRY * len(handles)) + 0.4)
    drawing.legend(handles=handles, loc="outside right upper", handlelength=3.2)
    return drawing, list(drawing.subplots(count, 1, squeeze=False, sharex=sharex)[:, 0])


def looks(solvers: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Colour and marker of each solver, different for up to some hundred of them.

    A solver without a fixed pair has the spare one at the checksum of its name, or the next that is free.
    """
    pairs = dict(FIXED)
    for solver in sorted(set(solvers) - set(FIXED)):
        place = zlib.crc32(solver.encode()) % len(SPARE)
        free = (pair for pair in SPARE[place:] + SPARE[:place] if pair not in pairs.values())
        pairs[solver] = next(free, SPARE[place])
    return pairs


def line_styles(cells: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """Keyword arguments of `Axes.plot` for each method of some cells."""
    styles: dict[str, dict[str, Any]] = {}
    pairs = looks(cells["solver"])
    for (solver, form), lines in cells.groupby(["solver", "form"]):
        full, marker = pairs[str(solver)]
        dashes, face = LOOKS.get(str(form), LOOKS["sparse"])
        methods = sorted(lines["method"].unique())
        for i, method in enumerate(methods):
            size, filled = VARIANTS[i % len(VARIANTS)]
            color = _tinted(full, PALEST * i / max(len(methods) - 1, 1))
            styles[method] = {
                "color": color,
                "marker": marker,
                "markersize": size,
                "markeredgecolor": color,
                "markerfacecolor": _tinted(color, face),
                "markeredgewidth": 1.3,
                "fillstyle": filled,
                "markerfacecoloralt": "white",
                "linestyle": dashes,
                "linewidth": 1.6,
            }
    return styles


def _tinted(color: str, tint: float) -> str:
    """A colour mixed with white."""
    red, green, blue = (c + tint * (1 - c) for c in to_rgb(color))
    return to_hex((red, green, blue))


def forms_text(cells: pd.DataFrame) -> str:
    """How the forms of some cells look: 'Solid and filled: dual form; dashed and hollow: primal form.'"""
    words = "; ".join(words for form, words in FORMS.items() if (cells["form"] == form).any())
    return f" {words[0].upper()}{words[1:]}." if words else ""


def legend_entries(styles: dict[str, dict[str, Any]]) -> list[Line2D]:
    return [Line2D([], [], label=method, **look) for method, look in styles.items()]


def percent_above(axes: Axes, whole: float) -> None:
    """A second axis at the top, in % of `whole`."""
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
