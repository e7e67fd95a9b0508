"""Every solver on every rung of every ladder, as one picture."""

from __future__ import annotations

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

from . import style

ROW, COLUMN = 0.18, 0.15  # inches
GAP = 0.6  # between ladders, in columns
LABELS = 1.9  # inches to the left of the cells, for the names of the lines

#: Face, hatch and mark of an outcome, distinct in greyscale too.
LOOKS: dict[str, tuple[str, str, str]] = {
    CORRECT: (style.BLUE, "", ""),
    CORRECT_UNCLAIMED: ("#A9CFE8", "", ""),
    UNJUDGED: ("white", "", "?"),
    NO_ANSWER: ("#E6E6E6", "", "–"),
    WRONG_UNCLAIMED: ("white", "//////", ""),
    WRONG_CLAIMED: (style.VERMILLION, "", "×"),
}


def ladder_map(cells: pd.DataFrame, order: list[str], ladders: dict[str, list[str]]) -> Figure:
    """cells : with outcomes. order : labels, the rows. ladders : the rungs of each ladder, the columns."""
    panels = _panels(ladders)
    height = len(order) * ROW * len(panels) + 1.25 * len(panels) + 0.3
    drawing = style.figure(height)
    places: Any = cells.set_index(["label", "ladder", "rung"])["outcome"].to_dict()
    for axes, names in zip(drawing.subplots(len(panels), 1, squeeze=False)[:, 0], panels, strict=True):
        _panel(axes, places, order, {name: ladders[name] for name in names})
    handles = [
        Patch(facecolor=face, hatch=hatch, edgecolor="#888888", linewidth=0.5, label=f"{name} {mark}".strip())
        for name, (face, hatch, mark) in LOOKS.items()
    ]
    drawing.legend(handles=handles, loc="outside lower center", ncols=3)
    return drawing


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


def _panel(
    axes: Axes, places: dict[tuple[str, str, str], str], order: list[str], ladders: dict[str, list[str]]
) -> None:
    x, ticks, names = 0.0, [], []
    for ladder, rungs in ladders.items():
        left = x
        for rung in rungs:
            for y, label in enumerate(order):
                if (label, ladder, rung) in places:
                    _cell(axes, x, y, places[label, ladder, rung])
            ticks.append(x)
            names.append(rung)
            x += 1
        axes.annotate(
            ladder, ((left + x - 1) / 2, 1), (0, 3), xycoords=axes.get_xaxis_transform(),
            textcoords="offset points", ha="center", fontsize=8, weight="bold", annotation_clip=False,
        )  # fmt: skip
        x += GAP
    room = (style.WIDTH - LABELS) / COLUMN
    axes.set(xlim=(-0.6, max(x - GAP, room) - 0.4), ylim=(len(order) - 0.4, -0.6))
    axes.set_xticks(ticks, names, rotation=90, fontsize=6.5)
    axes.set_yticks(range(len(order)), order, fontsize=8)
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)


def _cell(axes: Axes, x: float, y: float, outcome: str) -> None:
    face, hatch, mark = LOOKS[outcome]
    looks: Any = {"facecolor": face, "hatch": hatch, "edgecolor": "#999999", "linewidth": 0.4}
    axes.add_patch(Rectangle((x - 0.46, y - 0.44), 0.92, 0.88, **looks))
    ink = "white" if outcome == WRONG_CLAIMED else "#555555"
    axes.text(x, y + 0.03, mark, ha="center", va="center", color=ink, fontsize=8, weight="bold")
