"""The figure at the head of a report: every solver on every scene."""

from __future__ import annotations

import math
from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from . import style
from .numbers import power, significant, whole

ROW = 0.26  # inches
GAP = 0.3  # between sizes, in columns
FEWEST = 7.0  # columns that the figure has room for at least: cells of few scenes stay small
SLOWEST = 100.0  # times the fastest of a scene: the pale end of the shading
SHORT = {"memory_limit": "memory", "iteration_limit": "iterations", "unsupported": "n/a"}


def scoreboard(cells: pd.DataFrame, standings: pd.DataFrame) -> Figure:
    """A row a line of the standings, a column a scene by size and active contacts.

    Where the answer is within the limit, seconds a load case on a shade of blue (dark: the fastest of
    the scene; pale: 100 times as long); where it is not, its error in mm on hatching; where there is
    none, the reason. At the right, the number of scenes within the limit.
    """
    labels = standings["label"].tolist()
    cells = cells[cells["label"].isin(labels)]
    scenes = cells.drop_duplicates("scene").sort_values(["n", "active", "scene"])
    sizes = list(scenes["n"].unique())
    x = {s.scene: i + GAP * sizes.index(s.n) for i, s in enumerate(scenes.itertuples())}
    counts = max(x.values()) + 1 + GAP
    fastest = cells[cells["verdict"] == "within"].groupby("scene")["load_case_s"].min()

    drawing = style.figure(0.8 + ROW * len(labels))
    axes = drawing.add_subplot()
    points = 72 * 6.2 / max(counts + 1, FEWEST)  # a cell's width
    for row in cells.itertuples():
        _cell(axes, (x[row.scene], labels.index(row.label)), row, fastest.get(row.scene, math.nan), points)
    for y, line in enumerate(standings.itertuples()):
        text = f"{line.within} of {line.scenes}"
        axes.text(counts, y, text, ha="center", va="center", fontsize=8.5, in_layout=False)

    axes.set(xlim=(-0.55, max(counts + 0.6, FEWEST)), ylim=(len(labels) - 0.45, -0.55))
    axes.set_yticks(range(len(labels)), labels)
    axes.set_xticks([*x.values(), counts], [*map(whole, scenes["active"]), "within"])
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    rim = axes.get_xaxis_transform()
    for n, group in scenes.groupby("n"):
        places = [x[scene] for scene in group["scene"]]
        first, last = min(places), max(places)
        axes.plot([first - 0.48, last + 0.48], [1, 1], color="#444444", lw=0.8, transform=rim, clip_on=False)
        axes.annotate(
            f"n = {n:.0f}", ((first + last) / 2, 1), (0, 20), xycoords=rim, textcoords="offset points",
            ha="center", weight="bold", annotation_clip=False,
        )  # fmt: skip
    axes.annotate(
        "active contacts", (0, 1), (-8, 6), xycoords="axes fraction", textcoords="offset points", ha="right"
    )
    return drawing


def _cell(axes: Axes, at: tuple[float, float], row: Any, fastest: float, points: float) -> None:
    (x, y), face, ink, hatch = at, "#F1F1F1", "#555555", None
    if row.verdict == "within":
        slow = min(1.0, math.log(max(1.0, row.load_case_s / fastest)) / math.log(SLOWEST))
        face = mpl.colors.to_hex(mpl.colormaps["Blues"](0.88 - 0.78 * slow))
        ink = "white" if slow < 0.45 else "black"
        text = significant(row.load_case_s, 2)
    elif row.verdict == "outside":
        face, ink, hatch = "white", "black", "//////"
        text = power(row.displacement_error_mm, 2)
    elif row.verdict == "cannot_be_judged":
        text = "?"
    elif row.status == "time_limit" and row.time_limit_s > 0:
        text = f"> {row.time_limit_s:.0f} s"
    else:
        text = SHORT.get(row.status, row.status.replace("_", " "))
    axes.add_patch(Rectangle((x - 0.48, y - 0.45), 0.96, 0.9, facecolor=face, hatch=hatch, linewidth=0))
    box = {"facecolor": "white", "pad": 1.0, "linewidth": 0} if hatch else None
    fontsize = min(8.5, points / (0.58 * max(len(text), 4)))
    axes.text(x, y, text, ha="center", va="center", fontsize=fontsize, color=ink, bbox=box, in_layout=False)
