"""The files on the contacts of a series whose gap is larger than allowed: a table and a map."""

from pathlib import Path

import pandas as pd
from matplotlib.colors import Normalize

from report.figures import style
from report.figures.junction_maps import Map, Scale, map_sheet
from report.results.series_results import Array, Series


def write(directory: Path, series: Series, allowed_mm: float, shares: Array, largest: Array) -> None:
    """Write DIRECTORY/allowed-gap.csv, one row per contact, and allowed-gap.png if its places are known.

    shares : (m,) of the cases in which the gap of a contact is larger. largest : (m,) mm, in these cases.
    """
    table = pd.DataFrame({"share_of_cases": shares, "largest_gap_mm": largest})
    if series.nodes is not None:
        table.insert(0, "x_mm", series.nodes[:, 0])
        table.insert(1, "y_mm", series.nodes[:, 1])
        percent = 100 * shares
        scale = Scale("share of cases, %", "magma_r", Normalize(0.0, float(percent.max()) or 1.0))
        title = f"cases with a gap of more than {allowed_mm:g} mm"
        with style.applied():
            drawing, _ = map_sheet([Map(title, series.nodes, percent, scale)], 1)
            drawing.savefig(directory / "allowed-gap.png", dpi=style.DPI)
    table.to_csv(directory / "allowed-gap.csv", index_label="contact")
