"""The fastest solver and settings for an error of at most X at size Y."""

from __future__ import annotations

from typing import Any

import pandas as pd

from report.analysis.precision import ACCURACIES, judged, settings, swept
from report.analysis.standings import TIE, preferred
from report.document.blocks import Place, Section, Table, number, word
from report.document.numbers import listed, power, significant, tidy_power, whole
from report.results.reader import Results

PLACE = Place(120)


def section(results: Results) -> Section | None:
    cells = swept(results)
    if cells.empty:
        return None
    lines = [recommended(of_size, x) for _, of_size in cells.groupby("n") for x in ACCURACIES]
    columns = [
        number("n", "n", whole),
        number("error ≤, mm", "accuracy_mm", tidy_power),
        word("use", "use"),
        number("with tolerance", "tolerance", tidy_power),
        number("s per load case", "seconds"),
        word(f"as fast, to within {TIE - 1:.0%}", "ties"),
    ]
    caption = (
        "*The fastest settings whose error was small enough on every scene of the size*; of a solver's "
        "equally fast tolerances, the tightest. Seconds are the geometric mean over the scenes, without "
        "conversion and preparation."
    )
    table = Table("recommendation", caption, pd.DataFrame(lines), columns)
    return Section("Recommended settings by accuracy", [table])


def recommended(cells: pd.DataFrame, accuracy: float) -> dict[str, Any]:
    """The fastest settings at one size whose error is ≤ accuracy on all its scenes, and those as fast."""
    line: dict[str, Any] = {"n": cells["n"].iloc[0], "accuracy_mm": accuracy, "use": "nothing reaches it"}
    line |= {"tolerance": None, "seconds": None, "ties": ""}
    if not judged(cells, accuracy):
        bound = power(cells["reference_bound_mm"].max(), 2)
        return line | {"use": f"cannot be judged: the reference error bound is {bound} mm"}
    seconds = settings(cells, accuracy)
    if seconds.empty:
        return line
    best, *others = preferred(seconds, cells).to_dict("records")
    ties = [_tie(other) for other in others if other["seconds"] <= TIE * best["seconds"]]
    line |= {"use": best["method"], "tolerance": best["tolerance"], "seconds": best["seconds"]}
    return line | {"ties": listed(ties) if ties else ""}


def _tie(line: dict[Any, Any]) -> str:
    at = "" if pd.isna(line["tolerance"]) else f" at {tidy_power(line['tolerance'])}"
    return f"{line['method']}{at} ({significant(line['seconds'])} s)"
