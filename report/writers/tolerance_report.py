"""Writes the report of a tolerance: the share of the joints that keep the gap against the value of a key."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from report.document.blocks import Figure, Section, Text
from report.document.escape import quoted
from report.figures import style
from report.writers.sections_writer import written

CAPTION = "*The joints that keep the gap, with 95 % intervals*; the line is the share asked for."
LOOKS = {False: (style.BLUE, "the cases that chose"), True: (style.VERMILLION, "fresh cases")}


def write(directory: Path, key: str, share: float, said: Sequence[str], shares: Sequence[object]) -> Path:
    """Write report.md, shares.png and shares.csv. shares : of each value tried, with its interval."""
    key, said = quoted(key), [*map(quoted, said)]  # with the name of a scene
    table = pd.DataFrame(shares).sort_values(["fresh", "value"])
    with style.applied():
        drawing, axes = style.single(3.2)
        for fresh, (colour, label) in LOOKS.items():
            rows = 100 * table.loc[table["fresh"] == fresh, ["share", "low", "high"]]
            ends = abs(rows[["low", "high"]].sub(rows["share"], axis=0)).to_numpy().T
            points = table["value"][rows.index], rows["share"], ends
            axes.errorbar(*points, fmt="o", markersize=4, capsize=3, color=colour, label=label)
        axes.axhline(100 * share, color=style.BLACK, linewidth=0.8)
        axes.set(xlabel=key, ylabel="joints that keep the gap, %")
        drawing.legend(loc="outside upper center", ncols=2)
    section = Section("Summary", [Text("\n\n".join(said)), Figure("shares", CAPTION, drawing, table)])
    return written(directory / "report.md", key, [section])
