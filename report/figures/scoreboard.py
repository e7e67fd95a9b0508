"""The first figure of a report: every solver on every scene."""

from __future__ import annotations

import math
from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from report.document.numbers import power, significant, whole

from . import style

ROW = 0.26  # inches
GAP = 0.3  # between sizes, in columns
HEADED = 1.8  # columns, the least width of the heading of a size
FEWEST = 7.0  # columns, the least width of the figure: cells of few scenes stay small
WIDEST = 19.0  # columns, the largest width of a strip, unless one size has more
SLOWEST = 100.0  # times as long as the fastest of a scene: the pale end of the shading
SHORT = {"memory_limit": "memory", "iteration_limit": "iterations", "unsupported": "n/a"}


def scoreboard(cells: pd.DataFrame, standings: pd.DataFrame) -> Figure:
    """One row per line of the standings, one column per scene by size and active contacts; what is too wide
    continues in a further strip below.

    If the answer is within the limit, seconds per load case on a shade of blue (dark: the fastest of the
    scene; pale: 100 times as long); if it is not, its error in mm on hatching; if there is none, the reason.
    On the right, the number of scenes within the limit.
    """
    scenes = cells.drop_duplicates("scene").sort_values(["n", "active", "scene"])
    places = _strips(scenes)
    columns = max(max(x.values()) for x in places) + 1
    strips = [cells[cells["scene"].isin(x)] for x in places]
    lines = [standings[standings["label"].isin(strip["label"])] for strip in strips]
    heights = [0.8 + ROW * len(of_strip) for of_strip in lines]
    drawing = style.figure(sum(heights))
    panels = drawing.subplots(len(strips), 1, height_ratios=heights, squeeze=False)[:, 0]
    for axes, strip, of_strip, x in zip(panels, strips, lines, places, strict=True):
        axes.set(xlim=(-0.55, max(columns + GAP + 0.6, FEWEST)), ylim=(len(of_strip) - 0.45, -0.55))
        _cells(axes, strip, of_strip["label"].tolist(), x)
        _headings(axes, scenes[scenes["scene"].isin(x)], x)
        _within(axes, of_strip, columns + GAP)
    return drawing


def _strips(scenes: pd.DataFrame) -> list[dict[str, float]]:
    """The place of each scene in its strip: as many sizes side by side as fit."""
    strips: list[dict[str, float]] = [{}]
    start = 0.0
    for _, group in scenes.groupby("n"):
        if start and start + len(group) > WIDEST:
            strips.append({})
            start = 0.0
        indent = max(0.0, HEADED - len(group)) / 2
        strips[-1] |= {scene: start + indent + i for i, scene in enumerate(group["scene"])}
        start += max(len(group), HEADED) + GAP
    return strips


def _cells(axes: Axes, cells: pd.DataFrame, labels: list[str], x: dict[str, float]) -> None:
    axes.set_yticks(range(len(labels)), labels)
    points = _width(axes)
    fastest = cells[cells["verdict"] == "within"].groupby("scene")["load_case_s"].min()
    for row in cells[cells["label"].isin(labels)].itertuples():
        at = x[str(row.scene)], labels.index(str(row.label))
        _cell(axes, at, row, fastest.get(row.scene, math.nan), points)


def _width(axes: Axes) -> float:
    """The width of a cell, points."""
    left, right = axes.get_xlim()
    return 72 * 6.2 / (right - left)


def _size(text: str, points: float) -> float:
    """The size of the type in which a text fits that width."""
    return min(8.5, points / (0.58 * max(len(text), 4)))


def _within(axes: Axes, lines: pd.DataFrame, x: float) -> None:
    axes.annotate(
        "within", (x, 1), (0, 6), xycoords=axes.get_xaxis_transform(), textcoords="offset points",
        ha="center", annotation_clip=False,
    )  # fmt: skip
    for y, line in enumerate(lines.itertuples()):
        text = f"{line.within} of {line.scenes}"
        axes.text(x, y, text, ha="center", va="center", fontsize=8.5, in_layout=False)


def _headings(axes: Axes, scenes: pd.DataFrame, x: dict[str, float]) -> None:
    active = [*map(whole, scenes["active"])]
    size = _size(max(active, key=len), _width(axes))
    axes.set_xticks([x[scene] for scene in scenes["scene"]], active, fontsize=size)
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
    size = _size(text, points)
    axes.text(x, y, text, ha="center", va="center", fontsize=size, color=ink, bbox=box, in_layout=False)
