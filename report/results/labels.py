"""The name of a line in tables and figures: what was run, in as few words as tell it apart."""

from __future__ import annotations

import pandas as pd

from report.document.numbers import counted, tidy_power

#: In-house first, then the libraries; what is not named here follows by name.
IN_HOUSE = ("ipm", "gi", "newton", "ipm-fast")
ORDER = (*IN_HOUSE, "piqp", "proxqp", "clarabel", "osqp", "daqp", "quadprog", "highs")


def named(cells: pd.DataFrame) -> pd.DataFrame:
    """Cells with `series`, 'solver (form)' with the variant if it has one and the number of threads
    where several were used, and `label`, the same with the tolerance where there are several.
    """
    variant = cells["variant"].map(lambda name: f" {name}" if name else "")
    threads = cells["threads"].map(lambda k: f" × {counted(int(k), 'thread')}")
    tolerance = cells["tolerance"].map(lambda value: f" {tidy_power(value)}")
    by_line = cells.groupby(["solver", "form", "variant"], dropna=False)
    threads = threads.where(by_line["threads"].transform("nunique") > 1, "")
    tolerance = tolerance.where(by_line["tolerance"].transform("nunique") > 1, "")
    series = cells["solver"] + " (" + cells["form"] + ")" + variant + threads
    return cells.assign(series=series, label=series + tolerance)


def rank(solver: str, form: str) -> tuple[int, str, bool]:
    """Sort key of lines: known solvers in their order, the dual form before the primal."""
    return (ORDER.index(solver) if solver in ORDER else len(ORDER), solver, form != "dual")


def in_order(cells: pd.DataFrame, name: str = "label") -> list[str]:
    """The labels (or series) of some cells in the one order used everywhere."""
    lines = cells.drop_duplicates(name)
    ranks = [rank(solver, form) for solver, form in zip(lines["solver"], lines["form"], strict=True)]
    return [label for _, label in sorted(zip(ranks, lines[name].astype(str), strict=True))]
