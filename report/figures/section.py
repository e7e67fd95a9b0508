"""A section through the largest gap of an answer: the faces of the two parts, before and after."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from report.document.numbers import significant

from . import style
from .maps import Array, grid_of


def section_figure(record: dict[str, Any], arrays: dict[str, Array]) -> Figure | None:
    """Along both grid lines through the largest gap; None without contacts, or if they are on no grid."""
    if not record["m"] or not {"contact_nodes", "A_data"} <= set(arrays):
        return None
    gap, pair = arrays["gap_after"], worst_pair(record, arrays)
    worst = int(gap.argmax())
    own = slice(pair["start"], pair["stop"])
    nodes = arrays["contact_nodes"][own]
    if (grid := grid_of(nodes)) is None:
        return None
    x, y, place = grid
    row, column = divmod(int(place[worst - pair["start"]]), len(x))
    first = first_faces(arrays)[own]
    faces = {"before": (np.zeros(len(nodes)), arrays["gap_before"][own]), "after": (first, first + gap[own])}
    lines = {
        f"along x at y = {significant(y[row])} mm": ("x, mm", x, row * len(x) + np.arange(len(x))),
        f"along y at x = {significant(x[column])} mm": ("y, mm", y, np.arange(len(y)) * len(x) + column),
    }
    with style.applied():
        figure = style.figure(3.0)
        node = np.argsort(place)
        panels = figure.subplots(1, 2, sharey=True, width_ratios=(2, 1))
        for axes, (title, (name, at, line)) in zip(panels, lines.items(), strict=True):
            _draw(axes, at, {when: [face[node[line]] for face in both] for when, both in faces.items()})
            axes.set(title=title, xlabel=name)
        panels[0].set_ylabel("normal to the junction, mm")
        names = pair["pair"] if len(pair["pair"]) == 2 else ["one side", "the other"]
        handles, _ = panels[0].get_legend_handles_labels()
        labels = [f"{names[0]}, after", f"{names[1]}, after", "gap left", "before"]
        figure.legend(handles, labels, loc="outside lower left", ncols=4)
    return figure


def worst_pair(record: dict[str, Any], arrays: dict[str, Array]) -> dict[str, Any]:
    """The pair of parts with the largest gap."""
    worst = int(arrays["gap_after"].argmax())
    return next(pair for pair in record["pairs"] if pair["start"] <= worst < pair["stop"])


def first_faces(arrays: dict[str, Array]) -> Array:
    """(m,) mm: how far the first part of each contact has moved, the positive part of A times x."""
    shape = len(arrays["x"]), len(arrays["gap_after"])
    A = sp.csc_array((arrays["A_data"], arrays["A_indices"], arrays["A_indptr"]), shape=shape)
    return np.asarray(A.maximum(0).T @ arrays["x"])


def _draw(axes: Axes, at: Array, faces: dict[str, list[Array]]) -> None:
    first, second = faces["after"]
    axes.plot(at, first, color=style.BLUE, label="first")
    axes.plot(at, second, color=style.VERMILLION, label="second")
    axes.fill_between(at, first, second, color=style.GREY, alpha=0.3, lw=0, label="gap")
    for k, face in enumerate(faces["before"]):
        axes.plot(at, face, ":", color=style.BLACK, lw=0.8, label="_" if k else "before")
