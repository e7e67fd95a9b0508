"""The name of a line in tables and figures: what was run, in as few words as distinguish it."""

from __future__ import annotations

import pandas as pd

from harness.results.schema import FORMS, OWNERS
from report.document.numbers import counted, tidy_power


def named(cells: pd.DataFrame) -> pd.DataFrame:
    """Cells with `method`, 'solver (form)' with the variant if it has one and the number of threads
    if several were used, and `label`, the same with the tolerance if there are several that were asked for.
    """
    variant = cells["variant"].map(lambda name: f" {name}" if name else "")
    threads = cells["threads"].map(lambda k: f" × {counted(int(k), 'thread')}")
    tolerance = cells["tolerance"].map(lambda value: f" {tidy_power(value)}")
    by_line = cells.groupby(["solver", "form", "variant"], dropna=False)
    threads = threads.where(by_line["threads"].transform("nunique") > 1, "")
    several = by_line["tolerance"].transform("nunique") > 1
    tolerance = tolerance.where(several & (cells["searched"] != 1.0), "")
    method = cells["solver"] + " (" + cells["form"] + ")" + variant + threads
    return cells.assign(method=method, label=method + tolerance)


def named_by(cells: pd.DataFrame, keys: list[str]) -> pd.DataFrame:
    """Cells named group by group: for tables with columns for the `keys`, which the names then omit."""
    groups = [named(group) for _, group in cells.groupby(keys)]
    return pd.concat([named(cells.iloc[:0]), *groups], ignore_index=True)


def lines_in_order(lines: pd.DataFrame, cells: pd.DataFrame, *first: str) -> pd.DataFrame:
    """One line per `method` of some cells, indexed or not: sorted by what comes first, then in the order of
    `in_order`.
    """
    places = {name: place for place, name in enumerate(in_order(cells, "method"))}
    lines = lines.reset_index() if "method" in lines.index.names else lines
    ordered = lines.assign(place=lines["method"].map(places)).sort_values(
        [*first, "place"], ignore_index=True
    )
    return ordered.drop(columns="place")


def in_order(cells: pd.DataFrame, name: str = "label") -> list[str]:
    """The labels (or method, or solvers) of some cells in the one order used everywhere: in the
    order of OWNERS, then by name, and the forms of a solver in the order of FORMS.
    """
    lines = cells.drop_duplicates(name)
    places = [
        (OWNERS.index(owner), solver, form_place(form), str(label))
        for owner, solver, form, label in zip(
            lines["owner"], lines["solver"], lines["form"], lines[name], strict=True
        )
    ]
    return [label for *_, label in sorted(places)]


def form_place(form: str) -> int:
    """The place of a form in the order of FORMS; a form not named there comes last."""
    return FORMS.index(form) if form in FORMS else len(FORMS)
