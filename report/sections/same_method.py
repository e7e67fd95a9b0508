"""An in-house code beside library codes of the same kind of method."""

from __future__ import annotations

from typing import Any

import pandas as pd

from report.analysis.seconds import seconds_text, timed
from report.document.blocks import Column, Place, Section, Table, number, records, word
from report.document.numbers import significant, whole
from report.results.reader import Results

PLACE = Place(140)

#: The in-house code, the form, and the library of the same method, a dual active-set method.
PAIRS = (("gi", "dual", "daqp"), ("gi", "primal", "quadprog"))


def section(results: Results) -> Section | None:
    """In a run with machine benchmarks, for every scene that both codes were measured on."""
    if not results.cells["cholesky_s"].notna().any():
        return None
    cells = timed(results.cells_by_threads())
    cells = cells.assign(text=[seconds_text(cell) for cell in records(cells)])
    lines = [line for pair in PAIRS for line in _lines(cells, *pair)]
    if not lines:
        return None
    columns = [
        word("scene", "scene"),
        number("active", "active", whole),
        number("threads", "threads", whole),
        word("in-house", "method"),
        word("s", "text"),
        word("library", "method_other"),
        word("s ", "text_other"),
        Column("ratio", _ratio),
    ]
    caption = (
        "*Goldfarb and Idnani's method beside the libraries' dual active-set codes*: seconds per load case, "
        "medians of the repeats, and their ratio, an upper bound if the library ran out of time."
    )
    return Section(
        "Against codes of the same method", [Table("same-method", caption, pd.DataFrame(lines), columns)]
    )


def _lines(cells: pd.DataFrame, solver: str, form: str, other: str) -> list[dict[str, Any]]:
    """One line per scene and number of threads that both were measured on."""
    keys = ["scene", "threads"]
    mine = cells[(cells["solver"] == solver) & (cells["form"] == form) & (cells["verdict"] == "within")]
    theirs = cells[(cells["solver"] == other) & (cells["form"] == form) & cells["at_least"].notna()]
    both = mine.merge(theirs[[*keys, "method", "text", "at_least", "cut"]], on=keys, suffixes=("", "_other"))
    return records(
        both.assign(ratio=both["load_case_s"] / both["at_least_other"]).sort_values(["n", "active"])
    )


def _ratio(line: Any) -> str:
    return ("< " if line["cut_other"] else "") + significant(line["ratio"])
