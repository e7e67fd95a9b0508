"""Where the time goes: the share of each step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from report.analysis.drawn import best_tolerances, middle_scenes, omission_note, tolerance_note
from report.document.blocks import Figure, Place, Section
from report.document.numbers import significant, whole
from report.figures import style
from report.results.reader import Results

PLACE = Place(400)

ROW = 0.2  # inches
STEPS = {
    "convert_s": ("convert: data into the solver's format", "#B8B8B8", None),
    "prepare_s": ("prepare: once per assembly", style.GREEN, None),
    "setup_s": ("set up: once per load case", style.ORANGE, "////"),
    "solve_s": ("solve", style.BLUE, None),
    "form_s": ("form: its load vector, and x from its solution", style.SKY, "...."),
}


def section(results: Results) -> Section | None:
    cells = best_tolerances(results)
    shown = [
        lines for scene in middle_scenes(results) if len(lines := _answered(cells[cells["scene"] == scene]))
    ]
    if not shown:
        return None
    heights = [0.3 + ROW * len(lines) for lines in shown]
    drawing = style.figure(sum(heights) + 0.2 * len(shown) + 0.9)
    panels = drawing.subplots(len(shown), 1, height_ratios=heights, sharex=True, squeeze=False)[:, 0]
    for axes, lines in zip(panels, shown, strict=True):
        _panel(axes, lines)
    panels[-1].set_xlabel("share of the time, %")
    handles = [Patch(facecolor=color, hatch=hatch, label=text) for text, color, hatch in STEPS.values()]
    drawing.legend(handles=handles, loc="outside lower center", ncols=3)
    caption = (
        "*Where the time goes*, on the middle scene of each size, the fastest first; on the right, the "
        "total in seconds, and iterations × milliseconds of solve per iteration (for an active-set method, "
        "per change of the active set). Runs without an answer are omitted. The Cholesky factor of K and Q, "
        "which the dense forms share, is built beforehand and not included."
        + tolerance_note(results)
        + omission_note(results)
    )
    return Section("Where the time goes", [Figure("time-steps", caption, drawing)])


def _answered(cells: pd.DataFrame) -> pd.DataFrame:
    return cells[cells["total_s"] > 0].sort_values("total_s")


def _panel(axes: Axes, lines: pd.DataFrame) -> None:
    places = np.arange(len(lines))
    left = np.zeros(len(lines))
    for name, (_, color, hatch) in STEPS.items():
        share = (100 * lines[name].fillna(0) / lines["total_s"]).to_numpy(dtype=float)
        look: dict[str, Any] = {"color": color, "hatch": hatch, "edgecolor": "white", "linewidth": 0.6}
        axes.barh(places, share, left=left, height=0.72, **look)
        left += share
    for place, line in enumerate(lines.to_dict("records")):
        text = f"{significant(line['total_s'])} s"
        if line["iterations"] > 0:
            each = significant(1000 * line["solve_s"] / line["iterations"])
            text += f",  {whole(line['iterations'])} × {each} ms"
        axes.annotate(text, (100, place), (6, 0), textcoords="offset points", va="center", fontsize=8.5)
    axes.set(xlim=(0, 100), ylim=(len(lines) - 0.5, -0.5))
    axes.set_yticks(places, lines["method"])
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    n, active = lines["n"].iloc[0], lines["active"].iloc[0]
    axes.set_title(f"n = {n:.0f}" + (f", {active:.0f} active" if active == active else ""))
