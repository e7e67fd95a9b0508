"""A section through the largest gap of an answer: the faces of the two parts, before and after."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from report.document.numbers import coordinate

from . import style
from .node_cells import Array, grid_of

PLACE = {"left": 0.085, "right": 0.99, "bottom": 0.28, "top": 0.91, "wspace": 0.04}  # of the figure


def section_figure(record: dict[str, Any], arrays: dict[str, Array]) -> Figure | None:
    """The faces along both grid lines through the largest gap; None if the contacts are on no grid."""
    seen = around_worst(record, arrays)
    if seen is None or (grid := grid_of(seen.nodes)) is None:
        return None
    pair, first, initial = seen.pair, seen.first, arrays["gap_before"][seen.contacts]
    x, y, place = grid
    row, column = divmod(int(place[seen.gap.argmax()]), len(x))
    faces = {"before": (np.zeros(len(initial)), initial), "after": (first, first + seen.gap)}
    lines = {
        f"along x at y = {coordinate(y[row])} mm": ("x, mm", x, row * len(x) + np.arange(len(x))),
        f"along y at x = {coordinate(x[column])} mm": ("y, mm", y, np.arange(len(y)) * len(x) + column),
    }
    figure = Figure(figsize=(style.WIDTH, 3.0))
    node = np.argsort(place)
    panels = figure.subplots(1, 2, sharey=True, width_ratios=(2, 1), gridspec_kw=PLACE)
    for axes, (title, (name, at, line)) in zip(panels, lines.items(), strict=True):
        _draw(axes, at, {when: [face[node[line]] for face in both] for when, both in faces.items()})
        axes.set(title=title, xlabel=name)
    panels[0].set_ylabel("normal to the junction, mm")
    names = pair["pair"] if len(pair["pair"]) == 2 else ["one side", "the other"]
    handles, _ = panels[0].get_legend_handles_labels()
    labels = [f"{names[0]}, after", f"{names[1]}, after", "gap left", "before"]
    figure.legend(handles, labels, loc="lower left", ncols=4)
    return figure


@dataclass(frozen=True)
class Faces:
    """The `contacts` of a pair: nodes (c, 2), mm; the remaining gap, and the displacement of the first part's
    face, (c,) mm.
    """

    pair: dict[str, Any]
    contacts: slice
    nodes: Array
    gap: Array
    first: Array


def around_worst(record: dict[str, Any], arrays: dict[str, Array]) -> Faces | None:
    """The faces of the pair with the largest gap; None without contacts that have coordinates."""
    if not record["m"] or not {"contact_nodes", "A_data"} <= set(arrays):
        return None
    x, gap, nodes = (arrays[name] for name in ("x", "gap_after", "contact_nodes"))
    worst = int(gap.argmax())
    pair = next(pair for pair in record["pairs"] if pair["start"] <= worst < pair["stop"])
    contacts = slice(pair["start"], pair["stop"])
    parts = arrays["A_data"], arrays["A_indices"], arrays["A_indptr"]
    first = sp.csc_array(parts, shape=(len(x), len(gap))).maximum(0)[:, contacts].T @ x
    return Faces(pair, contacts, nodes[contacts], gap[contacts], np.asarray(first))


def _draw(axes: Axes, at: Array, faces: dict[str, list[Array]]) -> None:
    first, second = faces["after"]
    axes.plot(at, first, color=style.BLUE, label="first")
    axes.plot(at, second, color=style.VERMILLION, label="second")
    axes.fill_between(at, first, second, color=style.GREY, alpha=0.3, lw=0, label="gap")
    for k, face in enumerate(faces["before"]):
        axes.plot(at, face, ":", color=style.BLACK, lw=0.8, label="_" if k else "before")
