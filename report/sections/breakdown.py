"""Where the time goes: the seconds of each solver, and the share of each step."""

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
WIDTHS = (1.0, 1.2)  # of the totals and of the shares
BESIDE: dict[str, Any] = {"xytext": (6, 0), "textcoords": "offset points", "va": "center", "fontsize": 8}
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
    looks: dict[str, Any] = {"height_ratios": heights, "width_ratios": WIDTHS, "sharex": "col"}
    panels = drawing.subplots(len(shown), 2, squeeze=False, **looks)
    for (seconds, shares), lines in zip(panels, shown, strict=True):
        _seconds(seconds, lines)
        _shares(shares, lines)
    slowest, fastest = (of(lines["total_s"].agg(of.__name__) for lines in shown) for of in (max, min))
    panels[0, 0].set(xscale="log", xlim=(fastest / 2, slowest * 6))
    style.plain_log(panels[0, 0].xaxis)
    panels[-1, 0].tick_params(axis="x", labelsize=7.5)
    panels[-1, 0].set_xlabel("total, s (logarithmic)")
    panels[-1, 1].set_xlabel("share of the total, %")
    handles = [Patch(facecolor=color, hatch=hatch, label=text) for text, color, hatch in STEPS.values()]
    drawing.legend(handles=handles, loc="outside lower center", ncols=3)
    caption = (
        "*Where the time goes*, on the middle scene of each size, the fastest first. Left: the total. Right: "
        "what it consists of, and iterations × milliseconds of solve per iteration (for an active-set "
        "method, per change of the active set). Runs without an answer are omitted. The Cholesky factor of K "
        "and Q, which the dense forms share, is built beforehand and not included."
        + tolerance_note(results)
        + omission_note(results)
    )
    return Section("Where the time goes", [Figure("time-steps", caption, drawing)])


def _answered(cells: pd.DataFrame) -> pd.DataFrame:
    return cells[cells["total_s"] > 0].sort_values("total_s")


def _seconds(axes: Axes, lines: pd.DataFrame) -> None:
    places = np.arange(len(lines))
    axes.hlines(places, 0.0, lines["total_s"], color="#C9C9C9", linewidth=1.2)
    axes.plot(lines["total_s"], places, "o", color="#333333", markersize=5)
    for place, seconds in enumerate(lines["total_s"]):
        axes.annotate(f"{significant(seconds)} s", (seconds, place), **BESIDE)
    axes.set(ylim=(len(lines) - 0.5, -0.5))
    axes.set_yticks(places, lines["method"])
    axes.tick_params(axis="y", length=0)
    n, active = lines["n"].iloc[0], lines["active"].iloc[0]
    axes.set_title(f"n = {n:.0f}" + (f", {active:.0f} active" if active == active else ""))


def _shares(axes: Axes, lines: pd.DataFrame) -> None:
    places = np.arange(len(lines))
    left = np.zeros(len(lines))
    for name, (_, color, hatch) in STEPS.items():
        share = (100 * lines[name].fillna(0) / lines["total_s"]).to_numpy(dtype=float)
        look: dict[str, Any] = {"color": color, "hatch": hatch, "edgecolor": "white", "linewidth": 0.6}
        axes.barh(places, share, left=left, height=0.72, **look)
        left += share
    for place, line in enumerate(lines.to_dict("records")):
        if line["iterations"] > 0:
            each = significant(1000 * line["solve_s"] / line["iterations"])
            axes.annotate(f"{whole(line['iterations'])} × {each} ms", (100, place), **BESIDE)
    axes.set(xlim=(0, 100), ylim=(len(lines) - 0.5, -0.5))
    axes.set_yticks([])
    axes.grid(visible=False, axis="y")
