"""Writes where the gaps of a series are larger than allowed: a table of the contacts, and a map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.colors import Normalize

from report.analysis.allowed_gap import Exceeding
from report.figures import style
from report.figures.maps import draw
from report.figures.sheet import sheet
from report.results.series import Series

THINNEST = 0.02  # a map's shorter side over its longer one


def write(directory: Path, series: Series, found: Exceeding) -> Path:
    """Write DIRECTORY/allowed-gap.csv, one row per contact, and allowed-gap.png if its places are known."""
    table = pd.DataFrame({"share_of_cases": found.shares, "largest_gap_mm": found.largest})
    nodes = series.nodes
    if nodes is not None:
        table.insert(0, "x_mm", nodes[:, 0])
        table.insert(1, "y_mm", nodes[:, 1])
        low, high = nodes.min(axis=0), nodes.max(axis=0)
        size = np.maximum(high - low, THINNEST * (high - low).max() or 1.0)
        middle, title = (low + high) / 2, f"cases with a gap of more than {found.allowed_mm:g} mm"
        with style.applied():
            maps = sheet(middle - size / 2, middle + size / 2, [title], 1, 0)
            norm = Normalize(0.0, 100 * float(found.shares.max()) or 1.0)
            drawn = draw(maps.axes[0], nodes, 100 * found.shares, norm, "magma_r")
            maps.finished((drawn, "share of cases, %")).savefig(directory / "allowed-gap.png", dpi=style.DPI)
    path = directory / "allowed-gap.csv"
    table.to_csv(path, index_label="contact")
    return path
