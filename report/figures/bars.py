"""Seconds of the steps as stacked bars, one per method, a panel per scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from report.document.blocks import records
from report.document.escape import short
from report.document.numbers import significant

from . import style

ROW = 0.19  # inches
MOST = 12  # lines per panel
LONG, LONGEST = 30, 60  # characters of a name: beyond LONG, only one panel fits into a row
Looks = Mapping[str, tuple[str, str, str | None]]


def stacked(lines: pd.DataFrame, total: str, looks: Looks) -> Figure:
    """The fastest MOST of each scene first. looks : of each column of steps its name, colour and hatch."""
    scenes = [
        of.sort_values(total).head(MOST) for _, of in lines.groupby(["n", "active", "scene"], dropna=False)
    ]
    columns = 1 if len(scenes) == 1 or lines["method"].map(len).max() > LONG else 2
    rows = [scenes[k : k + columns] for k in range(0, len(scenes), columns)]
    heights = [0.45 + ROW * max(map(len, row)) for row in rows]
    drawing = style.figure(sum(heights) + 0.15 * len(rows) + 0.7)
    panels = drawing.subplots(len(rows), columns, height_ratios=heights, squeeze=False)
    for axes in panels.ravel()[len(scenes) :]:
        axes.set_axis_off()
    for axes, of_scene in zip(panels.ravel(), scenes, strict=False):
        places, left = np.arange(len(of_scene)), np.zeros(len(of_scene))
        for name, (_, color, hatch) in looks.items():
            width = of_scene[name].fillna(0.0).to_numpy(dtype=float)
            look: Any = {"color": color, "hatch": hatch, "edgecolor": "white", "linewidth": 0.4}
            axes.barh(places, width, left=left, height=0.74, **look)
            left += width
        for place, line in enumerate(records(of_scene)):
            at: Any = {"textcoords": "offset points", "va": "center", "fontsize": 8}
            axes.annotate(significant(line[total]), (left[place], place), (4, 0), **at)
        axes.set(xlim=(0, 1.14 * left.max()), ylim=(len(of_scene) - 0.5, -0.5), xlabel="seconds")
        axes.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        axes.set_yticks(places, [short(name, LONGEST) for name in of_scene["method"]])
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False, axis="y")
        n, active = of_scene["n"].iloc[0], of_scene["active"].iloc[0]
        axes.set_title(f"n = {n:.0f}" + (f", {active:.0f} active" if active == active else ""))
    used = [look for name, look in looks.items() if (lines[name] > 0).any()]
    handles = [Patch(facecolor=color, hatch=hatch, label=text) for text, color, hatch in used]
    drawing.legend(handles=handles, loc="outside lower center", ncols=4)
    return drawing
