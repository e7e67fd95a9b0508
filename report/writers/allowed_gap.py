"""Writes where the gaps of a series are larger than allowed: a table of the contacts, and a map."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from matplotlib.colors import Normalize

from report.analysis.allowed_gap import Exceeding
from report.figures import style
from report.figures.maps import Map, Scale, drawn
from report.results.series import Series


def write(directory: Path, series: Series, found: Exceeding) -> Path:
    """Write DIRECTORY/allowed-gap.csv, one row per contact, and allowed-gap.png if its places are known."""
    table = pd.DataFrame({"share_of_cases": found.shares, "largest_gap_mm": found.largest})
    if series.nodes is not None:
        table.insert(0, "x_mm", series.nodes[:, 0])
        table.insert(1, "y_mm", series.nodes[:, 1])
        percent = 100 * found.shares
        scale = Scale("share of cases, %", "magma_r", Normalize(0.0, float(percent.max()) or 1.0))
        title = f"cases with a gap of more than {found.allowed_mm:g} mm"
        with style.applied():
            drawing, _ = drawn([Map(title, series.nodes, percent, scale)], 1)
            drawing.savefig(directory / "allowed-gap.png", dpi=style.DPI)
    path = directory / "allowed-gap.csv"
    table.to_csv(path, index_label="contact")
    return path
