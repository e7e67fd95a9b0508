"""One question, one figure: how fast is it?"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd

from harness.results.schema import OWNERS
from report.analysis.roads import roads
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


FROM_SCENE = "a load case, from the scene on"
ONE_MORE = "one more load case on a known assembly"


def how_fast(results: Results) -> pd.DataFrame:
    """Per question and size n, over the scenes on which ours is within the limit:

    seconds, seconds_most : of the fastest of ours, the median and the worst scene
    library, library_least : how many times as long the fastest library takes, the median and the least
    library_none : the scenes on which no library is within the limit; they count as more than all others
    textbook, … : the same for the textbook methods

    Empty unless libraries and textbook methods were measured on these scenes, in sparse and in dense forms.
    """
    ways = roads(results)
    if ways.empty or not set(OWNERS) <= set(ways["owner"]):
        return pd.DataFrame()
    ways = ways[ways["verdict"] == "within"]
    lines = []
    for question, seconds in ((FROM_SCENE, "total_1_s"), (ONE_MORE, "load_case_s")):
        fastest = ways.groupby(["n", "scene", "owner"])[seconds].min().unstack("owner")
        known = fastest.reindex(columns=list(OWNERS)).dropna(subset="ours")
        lines += [{"question": question, "n": n} | _line(of_size) for n, of_size in known.groupby("n")]
    return pd.DataFrame(lines)


def _line(fastest: pd.DataFrame) -> dict[str, Any]:
    """fastest : seconds by scene and owner."""
    line: dict[str, Any] = {"scenes": len(fastest), "seconds": fastest["ours"].median()}
    line["seconds_most"] = fastest["ours"].max()
    for owner in OWNERS[1:]:
        times = fastest[owner] / fastest["ours"]
        line |= {owner: times.fillna(float("inf")).median(), f"{owner}_least": times.min()}
        line[f"{owner}_none"] = int(times.isna().sum())
    return line
