"""A comparison of runs on the terminal: the worst lines of it, and how many there are of each kind."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from report.writers.comparison import Comparison

LINES = 20  # of a table
LEFT_OUT = ("seconds", "status")  # for whole lines on a terminal


def show(comparison: Comparison, console: Console) -> None:
    """Print the measurements that changed, at most LINES, and a summary."""
    from report.analysis.comparison import ADDED, BETTER, SAME, WORSE
    from report.document.blocks import records
    from report.document.escape import plain
    from report.writers.comparison import COLUMNS

    columns = [column for column in COLUMNS if column.heading not in LEFT_OUT]
    changed = comparison.table[~comparison.table["group"].isin([ADDED, SAME])]
    title = plain(f"{comparison.old} → {comparison.new}")
    table = Table(*(column.heading for column in columns), title=title)
    for line in records(changed.head(LINES)):
        style = "red" if line["group"] == WORSE else "green" if line["group"] == BETTER else "yellow"
        table.add_row(*(plain(column.show(line)) for column in columns), style=style)
    if len(changed):
        console.print(table)
    if len(changed) > LINES:
        console.print(f"… and {len(changed) - LINES} more: --out writes them all", style="dim")
    console.print(plain(comparison.summary), style="red" if comparison.worse else "green")
