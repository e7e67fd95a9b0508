"""Maps of the remaining gaps of two scenes on one junction, and of their difference."""

from __future__ import annotations

from typing import Any

from matplotlib.colors import Normalize, PowerNorm
from matplotlib.figure import Figure

from . import style
from .answer import CLOSED, map_sheet, marked, outlined, pair_name
from .maps import Array, draw

Answer = tuple[dict[str, Any], dict[str, Array]]


def gap_maps(answers: list[Answer], names: list[str]) -> dict[str, Figure]:
    """`gaps`, each pair of each scene on one square-root scale with its closed contacts outlined, and
    `difference`, the second minus the first.
    """
    (first, one), (second, other) = answers
    nodes, pairs = one["contact_nodes"], first["pairs"]
    with style.applied():
        titles = [f"{name}: gap, {pair_name(pair)}" for pair in pairs for name in names]
        maps = map_sheet(nodes, titles, 2, len(first["marks"] | second["marks"]) + 1)
        largest = max(float(arrays["gap_after"].max()) for _, arrays in answers)
        norm = PowerNorm(0.5, 0.0, max(largest, 0.0) or 1.0)
        for k, pair in enumerate(pairs):
            own = slice(pair["start"], pair["stop"])
            for axes, (record, arrays) in zip(maps.axes[2 * k : 2 * k + 2], answers, strict=True):
                drawn = draw(axes, nodes[own], arrays["gap_after"][own], norm, "viridis")
                outlined(axes, nodes[own], arrays["lam"][own] > 0, CLOSED, "closed contacts")
                marked(axes, record["marks"])
        figures = {"gaps": maps.finished((drawn, "gap, mm"))}
        change = other["gap_after"] - one["gap_after"]
        size = float(abs(change).max()) or 1.0
        titles = [f"{names[1]} minus {names[0]}: {pair_name(pair)}" for pair in pairs]
        maps = map_sheet(nodes, titles, len(pairs), len(second["marks"]))
        for axes, pair in zip(maps.axes, pairs, strict=True):
            own = slice(pair["start"], pair["stop"])
            drawn = draw(axes, nodes[own], change[own], Normalize(-size, size), "RdBu_r")
            marked(axes, second["marks"])
        return figures | {"difference": maps.finished((drawn, "change of the gap, mm"))}
