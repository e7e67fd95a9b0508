"""The first figure of a report: every solver on every scene."""

from __future__ import annotations

import math
from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from report.document.numbers import listed, power, significant, whole

from . import style

ROW = 0.26  # inches
GAP = 0.3  # between sizes, in columns
HEADED = 1.8  # columns, the least width of the heading of a size
FEWEST = 7.0  # columns, the least width of the figure: cells of few scenes stay small
WIDEST = 19.0  # columns, the largest width of a strip, unless one size has more
ROOM = 446.0  # points for all columns
SLOWEST = 100.0  # times as long as the fastest of a scene: the pale end of the shading
SHORT = {"memory_limit": "memory", "iteration_limit": "iterations", "unsupported": "n/a"}


def explained(cells: pd.DataFrame, standings: pd.DataFrame, limit: str) -> str:
    """The caption of `scoreboard`, with the methods that it lacks."""
    words = (
        f"*Every solver on every scene, the best first.* Blue: within {limit}, seconds per load case, the "
        "darker, the closer to the fastest on the scene; hatched: outside, the error in mm; grey: no answer, "
        "and why; empty: not in the plan."
    )
    missing = sorted(set(standings["method"]) - set(cells["method"]))
    return words + (f" Run on fewer than half of the scenes: {listed(missing)}." if missing else "")


def scoreboard(cells: pd.DataFrame, standings: pd.DataFrame) -> Figure:
    """One row per method in the order of the standings, one column per scene by size and active contacts;
    what is too wide continues in a further strip below.

    cells : one per method and scene. Shades of blue: from the fastest of the scene to 100 times as long.
    """
    scenes = cells.drop_duplicates("scene").sort_values(["n", "active", "scene"])
    strips = _strips(scenes)
    columns = max(max(x.values()) for x in strips) + 1
    lines = [standings[standings["method"].isin(cells.loc[cells["scene"].isin(x), "method"])] for x in strips]
    heights = [0.8 + ROW * len(of_strip) for of_strip in lines]
    drawing = style.figure(sum(heights))
    panels = drawing.subplots(len(strips), 1, height_ratios=heights, squeeze=False)[:, 0]
    width = max(columns + GAP + 0.6, FEWEST)
    for axes, of_strip, x in zip(panels, lines, strips, strict=True):
        axes.set(xlim=(-0.55, width), ylim=(len(of_strip) - 0.45, -0.55))
        of_scenes = cells[cells["scene"].isin(x)]
        fastest = of_scenes[of_scenes["verdict"] == "within"].groupby("scene")["load_case_s"].min()
        methods = of_strip["method"].tolist()
        axes.set_yticks(range(len(methods)), methods)
        for cell in of_scenes.itertuples():
            at = x[str(cell.scene)], methods.index(str(cell.method))
            _cell(axes, at, cell, fastest.get(cell.scene, math.nan), ROOM / width)
        _headings(axes, scenes[scenes["scene"].isin(x)], x, ROOM / width)
        for y, line in enumerate(of_strip.itertuples()):
            axes.text(
                columns + GAP, y, f"{line.within} of {line.scenes}", ha="center", va="center", fontsize=8.5
            )
        _above(axes, "within", columns + GAP, 6)
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


def _size(text: str, points: float) -> float:
    """The size of the type in which a text fits that width."""
    return min(8.5, points / (0.58 * max(len(text), 4)))


def _above(axes: Axes, text: str, x: float, points: float, **look: Any) -> None:
    axes.annotate(
        text, (x, 1), (0, points), xycoords=axes.get_xaxis_transform(), textcoords="offset points",
        ha="center", annotation_clip=False, **look,
    )  # fmt: skip


def _headings(axes: Axes, scenes: pd.DataFrame, x: dict[str, float], points: float) -> None:
    active = [*map(whole, scenes["active"])]
    axes.set_xticks(
        [x[scene] for scene in scenes["scene"]], active, fontsize=_size(max(active, key=len), points)
    )
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    rim = axes.get_xaxis_transform()
    for n, group in scenes.groupby("n"):
        places = [x[scene] for scene in group["scene"]]
        first, last = min(places), max(places)
        axes.plot([first - 0.48, last + 0.48], [1, 1], color="#444444", lw=0.8, transform=rim, clip_on=False)
        _above(axes, f"n = {n:.0f}", (first + last) / 2, 20, weight="bold")
    axes.annotate(
        "active contacts", (0, 1), (-8, 6), xycoords="axes fraction", textcoords="offset points", ha="right"
    )


def _cell(axes: Axes, at: tuple[float, float], cell: Any, fastest: float, points: float) -> None:
    (x, y), face, ink, hatch = at, "#F1F1F1", "#555555", None
    if cell.verdict == "within":
        slow = min(1.0, math.log(max(1.0, cell.load_case_s / fastest)) / math.log(SLOWEST))
        face = mpl.colors.to_hex(mpl.colormaps["Blues"](0.88 - 0.78 * slow))
        ink = "white" if slow < 0.45 else "black"
        text = significant(cell.load_case_s, 2)
    elif cell.verdict == "outside":
        face, ink, hatch = "white", "black", "//////"
        text = power(cell.displacement_error_mm, 2)
    elif cell.verdict == "cannot_be_judged":
        text = "?"
    elif cell.status == "time_limit" and cell.time_limit_s > 0:
        text = f"> {cell.time_limit_s:.0f} s"
    else:
        text = SHORT.get(cell.status, cell.status.replace("_", " "))
    axes.add_patch(Rectangle((x - 0.48, y - 0.45), 0.96, 0.9, facecolor=face, hatch=hatch, linewidth=0))
    box = {"facecolor": "white", "pad": 1.0, "linewidth": 0} if hatch else None
    size = _size(text, points)
    axes.text(x, y, text, ha="center", va="center", fontsize=size, color=ink, bbox=box, in_layout=False)
