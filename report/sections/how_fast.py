"""One question, one figure: how fast is it?"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from report.analysis.how_fast import how_fast
from report.document.blocks import Column, Section, Table, number, word
from report.document.numbers import significant, whole
from report.results.reader import Results


def section(results: Results) -> Section | None:
    """For every solver in every form: against libraries, against textbook methods, in seconds."""
    table = how_fast(results)
    if table.empty:
        return None
    columns = [
        word("question", "question"),
        number("n", "n", whole),
        number("scenes", "scenes", whole),
        Column("the fastest library takes", _times("library")),
        Column("the fastest textbook method takes", _times("textbook")),
        Column("the fastest of ours, s (worst scene)", _seconds),
    ]
    caption = (
        "*How fast is it?* From the scene on: condensation, factors, Q and preparation included where a form "
        "needs them. How many times as long as the fastest of ours: the median over the scenes (the least). "
        "A scene on which none of them is within the limit counts as more than all others."
    )
    return Section("How fast is it?", [Table("how-fast", caption, table, columns, keys=2)])


def _times(owner: str) -> Callable[[Mapping[str, Any]], str]:
    def text(line: Mapping[str, Any]) -> str:
        median, least = line[owner], line[f"{owner}_least"]
        return f"{'more' if median == float('inf') else significant(median, 2)} × ({significant(least, 2)})"

    return text


def _seconds(line: Mapping[str, Any]) -> str:
    return f"{significant(line['seconds'], 2)} ({significant(line['seconds_most'], 2)})"
