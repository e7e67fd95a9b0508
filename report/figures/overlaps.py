"""Lines whose markers would hide each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.transforms import ScaledTranslation

from . import style

BESIDE = 6.0  # points between markers side by side
DECADES = 0.25  # markers at one place along the axis, less far apart than this, stand side by side


def side_by_side(axes: Axes, points: pd.DataFrame, x: str, y: str, styles: dict[str, dict[str, Any]]) -> None:
    """One line per method on a logarithmic y axis, through the true places of its points; markers at one x
    with nearly the same y are shifted along x, in the order of `styles`.
    """
    for method, look in styles.items():
        line = points[points["method"] == method]
        axes.plot(line[x], line[y], **style.line_only(look))
    order = list(styles)
    for _, place in points.groupby(x):
        ordered = place.sort_values(y)
        group = np.cumsum(np.diff(np.log10(ordered[y]), prepend=np.nan) > DECADES)
        for _, near in ordered.groupby(group):
            methods = sorted(near["method"], key=order.index)
            for i, method in enumerate(methods):
                inches = BESIDE * (i - (len(methods) - 1) / 2) / 72
                shift = ScaledTranslation(inches, 0, axes.figure.dpi_scale_trans)
                point = near[near["method"] == method]
                look = style.marker_only(styles[method])
                axes.plot(point[x], point[y], **look, zorder=3, transform=axes.transData + shift)
