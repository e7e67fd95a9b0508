"""The command `compare`: what became worse between runs?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .options import error_reporting, option

if TYPE_CHECKING:
    from rich.console import Console

    from harness.results.comparison import Side
    from report.writers.comparison_report import Comparison

MAX_SLOWDOWN = 1.3
LINES = 20  # of a table
LEFT_OUT = ("seconds", "status")  # for whole lines on a terminal


def compare(
    old: Annotated[str, typer.Argument(metavar="OLD", help="Directory that `run` wrote.")],
    new: Annotated[list[str], typer.Argument(metavar="NEW...", help="Those to compare with it.")],
    max_digits_lost: Annotated[float, option("N", "Digits of the error that may be lost.", min=0.0)] = 1.0,
    max_slowdown: Annotated[
        float | None, option("FACTOR", f"Ratio of times that is allowed.  [default: {MAX_SLOWDOWN}]", min=1.0)
    ] = None,
    key: Annotated[str | None, option("KEY", "Only the row with this key.")] = None,
    out: Annotated[Path | None, option("DIR", "Write comparison.md and comparison.csv there.")] = None,
) -> None:
    """Compare runs, measurement by measurement; what became worse comes first.

    Worse is a worse verdict, more digits of the error lost than allowed, a time per load case beyond the
    allowed ratio and beyond the noise of both sides, or a measurement that is missing. Every NEW is compared
    with OLD. Times are compared if both sides are of one machine.

    \b
    Examples:
      python -m harness compare results/published/default results/default
      python -m harness compare before after --max-digits-lost 0.5 --max-slowdown 2 --out compared

    \b
    Exit codes: 0 nothing worse, 1 something became worse, 2 wrong usage or bad input,
                5 not comparable: other problems, limits or suites; --max-slowdown on another machine.
    """
    with error_reporting() as console:
        from harness.results.atomic_output import refuse_unwritable
        from harness.results.comparison import read_side
        from harness.results.records import MEASUREMENTS
        from harness.terminal import DONE, FAILED
        from report.writers.comparison_report import write

        if out:
            refuse_unwritable(out, [Path(name) / MEASUREMENTS for name in (old, *new)])
        before = read_side(old, key)
        compared = [_compared(before, read_side(name, key), max_digits_lost, max_slowdown) for name in new]
        for comparison in compared:
            _show(comparison, console)
        if out:
            console.print(f"Comparison: {write(out, compared)}")
        raise typer.Exit(FAILED if any(each.worse for each in compared) else DONE)


def _compared(old: Side, new: Side, max_digits_lost: float, max_slowdown: float | None) -> Comparison:
    import pandas as pd

    from harness.results.comparison import Incomparable, measurement, refuse_incomparable
    from report.analysis.comparison import compared
    from report.document.escape import quoted
    from report.results.rows import of_records
    from report.writers.comparison_report import Comparison

    refuse_incomparable(old, new)
    timed = len(old.machines | new.machines) == 1
    untimed = "" if timed else "Times are not compared: they are of different machines."
    if not timed and max_slowdown is not None:
        allowed = f"times of one machine: {'; '.join(sorted(old.machines | new.machines))}"
        raise Incomparable.one(new.name, "--max-slowdown", max_slowdown, allowed)
    before, after = (
        of_records([row | {"measurement": measurement(row)} for row in side.rows]) for side in (old, new)
    )
    table = compared(before, after, timed, max_digits_lost, max_slowdown or MAX_SLOWDOWN)
    names = quoted(old.name), quoted(new.name)
    both = pd.concat([rows.assign(side=side) for rows, side in zip((before, after), names, strict=True)])
    return Comparison(*names, table, untimed, both)


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
