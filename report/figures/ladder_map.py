"""Every solver on every rung of every ladder, as one picture.

A wrong answer says by how much: k if its error is up to 10ᵏ times the limit, ∞ beyond 10⁹⁹.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from report.analysis.outcomes import (
    CORRECT,
    CORRECT_UNCLAIMED,
    NO_ANSWER,
    UNJUDGED,
    WRONG_CLAIMED,
    WRONG_UNCLAIMED,
)
from report.document.blocks import records

from . import style

ROW, COLUMN = 0.145, 0.112  # inches
AROUND = 1.15  # inches above and below the cells of a panel
GAP = 0.6  # between ladders, in columns
LABELS = 1.55  # inches to the left of the cells, for the names of the lines

#: Face, hatch and mark of an outcome, distinct in greyscale too.
LOOKS: dict[str, tuple[str, str, str]] = {
    CORRECT: (style.BLUE, "", ""),
    CORRECT_UNCLAIMED: ("#A9CFE8", "", ""),
    UNJUDGED: ("white", "", "?"),
    NO_ANSWER: ("#E6E6E6", "", "–"),
    WRONG_UNCLAIMED: ("white", "//////", ""),
    WRONG_CLAIMED: (style.VERMILLION, "", ""),
}
WRONG = (WRONG_UNCLAIMED, WRONG_CLAIMED)
LARGEST = 1e99  # times the limit: the cell has room for two digits

#: What the rungs of a ladder count, and its unit.
COUNTED = {
    "coincident": "tie, N/mm",
    "conditioning": "cond(K)",
    "contact_scale": "2^±k in g",
    "degeneracy": "weak, %",
    "duplicates": "apart",
    "pivoting": "family, m",
    "refinement": "nodes along",
    "supports": "spring, N/mm",
    "thickness": "times as thick",
    "together": "cond(K)",
    "units": "of K and A",
}


def ladder_map(cells: pd.DataFrame, order: list[str], ladders: dict[str, list[str]]) -> Figure:
    """cells : with outcomes. order : labels, the rows. ladders : the rungs of each ladder, the columns."""
    panels = _panels(ladders)
    drawing = style.figure((len(order) * ROW + AROUND) * len(panels) + 0.4)
    table = cells.assign(text=[_text(cell) for cell in records(cells)])
    places: Any = table.set_index(["label", "ladder", "rung"])[["outcome", "text"]].to_dict("index")
    for axes, names in zip(drawing.subplots(len(panels), 1, squeeze=False)[:, 0], panels, strict=True):
        _panel(axes, places, order, {name: ladders[name] for name in names})
    handles = [
        Patch(facecolor=face, hatch=hatch, edgecolor="#888888", linewidth=0.5, label=f"{name} {mark}".strip())
        for name, (face, hatch, mark) in LOOKS.items()
    ]
    drawing.legend(handles=handles, loc="outside lower center", ncols=3)
    return drawing


def _text(cell: Mapping[str, Any]) -> str:
    """The mark of a cell's outcome, or of a wrong answer the power of ten of its error over the limit."""
    if cell["outcome"] not in WRONG:
        return LOOKS[cell["outcome"]][2]
    share = cell["displacement_error_mm"] / cell["limit_mm"]
    return f"{math.ceil(math.log10(share))}" if 1 <= share < LARGEST else "∞"


def _panels(ladders: dict[str, list[str]]) -> list[list[str]]:
    """The ladders row by row, as many as fit side by side."""
    room = (style.WIDTH - LABELS) / COLUMN
    panels: list[list[str]] = [[]]
    used = 0.0
    for name, rungs in ladders.items():
        if used + len(rungs) > room:
            panels.append([])
            used = 0.0
        panels[-1].append(name)
        used += len(rungs) + GAP
    return panels


def _panel(axes: Axes, places: Any, order: list[str], ladders: dict[str, list[str]]) -> None:
    """places : the outcome and text by label, ladder and rung."""
    x, ticks, names = 0.0, [], []
    for ladder, rungs in ladders.items():
        left = x
        for rung in rungs:
            for y, label in enumerate(order):
                if (label, ladder, rung) in places:
                    _cell(axes, x, y, **places[label, ladder, rung])
            ticks.append(x)
            names.append(rung)
            x += 1
        for text, above, size, weight in (
            (ladder, 10, 6.5, "bold"),
            (COUNTED.get(ladder, ""), 3, 5.5, "normal"),
        ):
            axes.annotate(
                text, ((left + x - 1) / 2, 1), (0, above), xycoords=axes.get_xaxis_transform(),
                textcoords="offset points", ha="center", fontsize=size, weight=weight, annotation_clip=False,
            )  # fmt: skip
        x += GAP
    room = (style.WIDTH - LABELS) / COLUMN
    axes.set(xlim=(-0.6, max(x - GAP, room) - 0.4), ylim=(len(order) - 0.4, -0.6))
    axes.set_xticks(ticks, names, rotation=90, fontsize=5.5)
    axes.set_yticks(range(len(order)), order, fontsize=7)
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)


def _cell(axes: Axes, x: float, y: float, outcome: str, text: str) -> None:
    face, hatch, _ = LOOKS[outcome]
    looks: Any = {"facecolor": face, "hatch": hatch, "edgecolor": "#999999", "linewidth": 0.4}
    axes.add_patch(Rectangle((x - 0.46, y - 0.44), 0.92, 0.88, **looks))
    ink = {WRONG_CLAIMED: "white", WRONG_UNCLAIMED: "black"}.get(outcome, "#555555")
    box = {"facecolor": "white", "pad": 0.4, "linewidth": 0} if hatch else None
    size = 6.5 if len(text) < 2 else 5.0
    axes.text(x, y + 0.03, text, ha="center", va="center", color=ink, fontsize=size, weight="bold", bbox=box)
