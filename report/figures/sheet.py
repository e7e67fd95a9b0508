"""A sheet of maps of one region, each in true proportions, with colour bars.

All sizes are known in advance. A layout engine would find them by drawing every label several times, which
takes longer than the picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from numpy.typing import NDArray

from report.document.escape import LONGEST_LABEL

from . import style

Array = NDArray[np.float64]
# inches
LEFT, RIGHT, TOP, BOTTOM = 0.85, 1.3, 0.35, 0.5
BESIDE, BELOW = 0.5, 0.4  # between maps; the title of the next one is below a map
NAME_LEFT, NAME_BELOW = 0.6, 0.27  # of an axis, from the map
LOWEST, TALLEST = 0.4, 5.5  # of a row, which has room for "y, mm"; of a map
LETTER = 0.09  # of a title, an upper bound on average
ENTRY, LINE = 1.7, 0.22  # of a legend
BAR, FROM_MAPS, SHORTEST = 0.18, 0.25, 1.0  # of a colour bar: width, distance, least height


@dataclass(frozen=True)
class Sheet:
    figure: Figure
    axes: list[Axes]
    bars: list[Axes]
    legend_columns: int

    def finished(self, *scales: tuple[ScalarMappable, str]) -> Figure:
        """The sheet with a labelled colour bar for each scale, and a legend of the labelled marks."""
        for bar, (drawn, label) in zip(self.bars, scales, strict=True):
            self.figure.colorbar(drawn, cax=bar, label=label)
        found = [axes.get_legend_handles_labels() for axes in self.axes]
        named = {text: mark for marks, texts in found for mark, text in zip(marks, texts, strict=True)}
        if named:
            self.figure.legend(named.values(), named.keys(), loc="lower left", ncols=self.legend_columns)
        return self.figure


def sheet(low: Array, high: Array, titles: list[str], columns: int, marks: int, bars: int = 1) -> Sheet:
    """An empty map of one region for each title, row by row; the outer ones have tick labels.

    low, high : the region's corners (x, y), mm. marks : the number of legend entries. bars : of scales.
    """
    rows, beside = -(-len(titles) // columns), bars * RIGHT
    ratio = (high[1] - low[1]) / (high[0] - low[0])
    room = (style.WIDTH - LEFT - beside - (columns - 1) * BESIDE) / columns
    width = min(room, TALLEST / ratio)
    height = width * ratio
    over = LETTER * min(max(map(len, titles)), LONGEST_LABEL)  # a title may be wider than its map
    across, down = max(width + BESIDE, over), max(height, LOWEST) + BELOW  # from a map to the next
    wide = LEFT + (columns - 1) * across + max(width + beside, over)
    long = (rows - 1) * down + height
    bar = max(long, SHORTEST)
    top = TOP + (bar - long) / 2  # the maps in the middle of the bar
    legend_columns = max(int(wide / ENTRY), 1)
    tall = TOP + bar + BOTTOM + -(-marks // legend_columns) * LINE
    figure = Figure(figsize=(wide, tall))

    def placed(left: float, bottom: float, width: float, height: float) -> Axes:
        return figure.add_axes((left / wide, bottom / tall, width / wide, height / tall))

    maps = []
    for k, title in enumerate(titles):
        row, column = divmod(k, columns)
        axes = placed(LEFT + column * across, tall - top - row * down - height, width, height)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x, mm", ylabel="y, mm")
        axes.set_title(title, y=1.0)  # a given place spares a search for it
        axes.xaxis.set_label_coords(0.5, -NAME_BELOW / height)
        axes.yaxis.set_label_coords(-NAME_LEFT / width, 0.5)
        axes.grid(visible=False)
        axes.spines[:].set_visible(True)
        first, last = column == 0, k + columns >= len(titles)
        axes.tick_params(left=first, labelleft=first, bottom=last, labelbottom=last)
        axes.yaxis.label.set_visible(first)
        axes.xaxis.label.set_visible(last)
        maps.append(axes)
    right = LEFT + (columns - 1) * across + width
    lefts = [right + FROM_MAPS + k * RIGHT for k in range(bars)]
    return Sheet(figure, maps, [placed(left, tall - TOP - bar, BAR, bar) for left in lefts], legend_columns)
