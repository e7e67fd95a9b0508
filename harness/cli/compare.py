"""The command `compare`: what became worse between runs?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .options import error_reporting, option

if TYPE_CHECKING:
    from rich.console import Console

    from report.writers.comparison_report import Comparison

LINES = 20  # of a table
LEFT_OUT = ("seconds", "status")  # for whole lines on a terminal


def compare(
    old: Annotated[str, typer.Argument(metavar="OLD", help="Directory that `run` wrote.")],
    new: Annotated[list[str], typer.Argument(metavar="NEW...", help="Runs to compare with OLD.")],
    max_digits_lost: Annotated[float, option("N", "Digits of the error that may be lost.", min=0.0)] = 1.0,
    max_slowdown: Annotated[
        float | None, option("FACTOR", "Ratio of times that is allowed.  [default: 1.3]", min=1.0)
    ] = None,
    key: Annotated[str | None, option("KEY", "Only the row with this key.")] = None,
    out: Annotated[
        Path | None, option("DIR", "Write comparison.md, its tables and index.html there.")
    ] = None,
) -> None:
    """Compare runs, measurement by measurement; what became worse comes first.

    Worse is a worse verdict, more digits of the error lost than allowed, a time per load case beyond the
    allowed ratio and beyond the noise of both sides, or a measurement that is missing. Every NEW is compared
    with OLD. Times are compared if both sides are of one machine. From a search for a tolerance, what it
    keeps is compared; runs that a trace stopped are not.

    \b
    Examples:
      python -m harness compare results/published/default results/default
      python -m harness compare before after --max-digits-lost 0.5 --max-slowdown 2 --out compared

    \b
    Exit codes: 0 nothing worse, 1 something became worse, 2 wrong usage or bad input,
                5 not comparable: other problems, limits or suites; --max-slowdown on another machine.
    """
    with error_reporting() as console:
        from harness.commands.run_comparison import compare as compare_runs
        from harness.terminal import DONE, FAILED

        comparisons = compare_runs(
            old, new, max_digits_lost=max_digits_lost, max_slowdown=max_slowdown, key=key, out=out
        )
        for comparison in comparisons:
            _show(comparison, console)
        if out:
            console.print(f"Comparison: {out / 'comparison.md'}")
        raise typer.Exit(FAILED if any(comparison.worse for comparison in comparisons) else DONE)


def merge(
    directories: Annotated[list[str], typer.Argument(metavar="DIR...", help="Directories that `run` wrote.")],
    out: Annotated[Path, option("DIR", "Output directory, without rows.")],
) -> None:
    """Put the rows of several machines into one directory, and report on each machine apart.

    No ratio or mean mixes two machines. Answers stay in their own directories, where `gate` judges them.

    \b
    Example:
      python -m harness merge laptop/default server/default --out both

    \b
    Exit codes: 0 written, 2 wrong usage or bad input,
                5 no measurement in common, other problems or limits, or one machine measured twice.
    """
    with error_reporting("", "Interrupted: `report` takes the merged rows, if they are there.") as console:
        from harness.commands.merged_runs import merge as merge_runs

        console.print(f"Report: {merge_runs(directories, out)}")


def _show(comparison: Comparison, console: Console) -> None:
    """Print the measurements that changed, at most LINES, and a summary."""
    from rich.table import Table

    from report.analysis.comparison import ADDED, BETTER, SAME, WORSE
    from report.document.blocks import records
    from report.document.escape import plain
    from report.writers.comparison_report import COLUMNS

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
