"""The faces of the parts around the largest gap of an answer, seen obliquely, their distance exaggerated."""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.tri import LinearTriInterpolator, Triangulation

from report.document.numbers import raised, significant
from report.results.answer_record import pair_name

from . import style
from .gap_section import around_worst
from .node_cells import Array, triangles_of

LINES = 40  # of each face, along either side
NARROWEST, HEIGHT = 0.4, 0.35  # of the view, to its longer side
TINY = float(np.finfo(float).tiny)


def deformed_figure(record: dict[str, Any], arrays: dict[str, Array]) -> Figure | None:
    """The second face coloured by the gap to the first, not to scale; bays and holes stay open. None without
    contacts on an area.
    """
    if (seen := around_worst(record, arrays)) is None:
        return None
    nodes, gap = seen.nodes, seen.gap
    if (corners := triangles_of(nodes)) is None:
        return None
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    X, Y = np.meshgrid(*(np.linspace(*ends, LINES) for ends in zip(low, high, strict=True)))
    x, y = ((nodes - low) / (high - low)).T
    triangles = Triangulation(x, y, corners)
    grid = (X - low[0]) / (high - low)[0], (Y - low[1]) / (high - low)[1]
    first, between = (
        LinearTriInterpolator(triangles, values)(*grid).filled(np.nan) for values in (seen.first, gap)
    )
    colours = ScalarMappable(Normalize(0.0, max(float(gap.max()), TINY)), colormaps["viridis"])
    look: dict[str, Any] = {"rcount": LINES, "ccount": LINES, "lw": 0.2, "clip_on": False}
    figure = style.figure(4.5)
    figure.set_layout_engine("none")
    axes: Any = figure.add_axes((0.0, 0.02, 0.85, 0.9), projection="3d")
    sides = np.maximum((high - low) / (high - low).max(), NARROWEST)
    axes.set_box_aspect((*sides, HEIGHT), zoom=1.2)
    axes.view_init(azim=-60 if sides[0] >= sides[1] else -30)  # the longer side across the picture
    axes.plot_surface(X, Y, first, color=style.GREY, **look)
    axes.plot_surface(X, Y, first + between, facecolors=colours.to_rgba(between), alpha=0.8, **look)
    axes.set(xlabel="x, mm", ylabel="y, mm", zlabel="normal, mm")
    axes.locator_params(nbins=4)
    figure.suptitle(
        f"{pair_name(seen.pair)}: at most {significant(raised(gap.max()))} mm apart", x=0.02, ha="left"
    )
    figure.colorbar(colours, cax=figure.add_axes((0.88, 0.25, 0.02, 0.5)), label="gap left, mm")
    return figure
