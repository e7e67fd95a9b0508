"""Whether the gaps of a series are larger than allowed: in how many cases, and at which contacts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from harness.terminal.exit_codes import DONE, GAP_EXCEEDED, NOTHING_JUDGED

SHOWN = 5  # contacts on the terminal


def check(directory: Path, allowed_mm: float, console: Console) -> int:
    """Print the outcome, write DIRECTORY/allowed-gap.csv and .png; returns the exit code."""
    from report.results.series import read
    from report.writers.allowed_gap import (
        exceeding,  # slow to import: not before the first row
        write,
    )

    series = read(directory)
    found = exceeding(series, allowed_mm)
    written = write(directory, series, found)
    if len(found.cases):
        worst, share = found.cases.iloc[0], len(found.cases) / found.answered
        console.print(
            f"FAIL: the gap is larger than {allowed_mm:g} mm in {len(found.cases)} of {found.answered} cases "
            f"({share:.1%}), at {np.count_nonzero(found.shares)} of {len(found.shares)} contacts; the "
            f"largest is {worst['max_gap_mm']:.3g} mm, in case {worst['case']:.0f}. Where: {written}",
            style="red",
        )
        table = Table("contact", "x, mm", "y, mm", "cases", "largest, mm", title="Most often exceeded")
        most_often = np.argsort(-found.shares, kind="stable")[:SHOWN]
        for k in most_often[found.shares[most_often] > 0]:
            place = ["–", "–"] if series.nodes is None else [f"{value:.4g}" for value in series.nodes[k]]
            table.add_row(str(k), *place, f"{found.shares[k]:.1%}", f"{found.largest[k]:.4g}")
        console.print(table)
    if found.undecided:
        console.print(
            f"In {found.undecided} of {found.answered} cases it cannot be told: the gaps are proven only to "
            f"{found.uncertainty_mm:.1e} mm.",
            style="yellow",
        )
    if len(found.cases):
        return GAP_EXCEEDED
    if found.undecided:
        return NOTHING_JUDGED
    largest = series.cases["max_gap_mm"].max()
    console.print(
        f"PASS: in none of {found.answered} cases is a gap larger than {allowed_mm:g} mm; the largest is "
        f"{largest:.3g} mm.",
        style="green",
    )
    return DONE
