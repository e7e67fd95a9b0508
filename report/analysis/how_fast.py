"""How fast is it? The fastest answers of ours, beside those of libraries and of textbook methods."""

from __future__ import annotations

from typing import Any

import pandas as pd

from harness.results.schema import OWNERS
from report.results.reader import Results

from .roads import roads

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
