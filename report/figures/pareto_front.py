"""A Pareto front of time and error, drawn as a staircase."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

STAIRCASE: dict[str, Any] = {"color": "#CFCFCF", "linewidth": 3.5, "zorder": 1, "solid_joinstyle": "miter"}


def staircase(axes: Axes, front: pd.DataFrame, time: str) -> None:
    """Draws a Pareto front as a staircase from the upper to the right edge of axes whose limits are final."""
    if front.empty:
        return
    errors, seconds = front["error"].tolist(), front[time].tolist()
    (_, right), (_, top) = axes.get_xlim(), axes.get_ylim()
    across, up = np.array([errors[0], *errors, right]), np.array([top, *seconds, seconds[-1]])
    axes.plot(across, up, drawstyle="steps-post", scalex=False, scaley=False, **STAIRCASE)
