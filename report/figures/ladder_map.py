"""Every solver on every rung of every ladder, as one picture.

A wrong answer says by how much: k if its error is up to 10ᵏ times the limit, ∞ beyond 10⁹⁹.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from report.analysis.outcomes import (
    CORRECT,
    CORRECT_UNCLAIMED,
    NO_ANSWER,
    UNJUDGED,
    WRONG_CLAIMED,
    WRONG_UNCLAIMED,
)
from report.document.blocks import records

from .grid import Cell, Group, grid
from .style import BLUE, VERMILLION

ROW, LEGEND = 0.16, 0.5  # inches
WIDEST = 66.0  # columns
#: Text, face, ink and hatch of an outcome, distinct in greyscale too; a wrong answer's text is its size.
LOOKS = {
    CORRECT: Cell("", BLUE),
    CORRECT_UNCLAIMED: Cell("", "#A9CFE8"),
    UNJUDGED: Cell("?", "white"),
    NO_ANSWER: Cell("–", "#E6E6E6"),
    WRONG_UNCLAIMED: Cell("", "white", "black", "//////"),
    WRONG_CLAIMED: Cell("", VERMILLION, "white"),
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
    groups = [
        Group(name, {f"{name}/{rung}": rung for rung in rungs}, COUNTED.get(name, ""))
        for name, rungs in ladders.items()
    ]
    found = {(cell["label"], f"{cell['ladder']}/{cell['rung']}"): _cell(cell) for cell in records(cells)}
    drawing = grid({label: label for label in order}, groups, found, ROW, WIDEST)
    handles = [
        Patch(
            facecolor=look.face,
            hatch=look.hatch,
            edgecolor="#888888",
            linewidth=0.5,
            label=f"{name} {look.text}",
        )
        for name, look in LOOKS.items()
    ]
    drawing.set_figheight(drawing.get_figheight() + LEGEND)
    drawing.legend(handles=handles, loc="outside lower center", ncols=3)
    return drawing


def _cell(cell: Mapping[str, Any]) -> Cell:
    look = LOOKS[cell["outcome"]]
    if cell["outcome"] not in WRONG:
        return look
    share = cell["displacement_error_mm"] / cell["limit_mm"]
    return replace(look, text=f"{math.ceil(math.log10(share))}" if 1 <= share < LARGEST else "∞")
