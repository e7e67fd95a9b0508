"""What each ingredient of a solver is worth: the solver without it, as a ratio to the whole."""

from __future__ import annotations

from typing import Any

import pandas as pd

from report.document.blocks import Column, Place, Section, Table, number, word
from report.document.numbers import spread, whole
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(150)

KEYS = ["solver", "form", "scene", "threads", "tolerance"]


def section(results: Results) -> Section | None:
    """Of solvers measured both as they are and as variants, in a run with yardsticks."""
    if not results.rows["cholesky_s"].notna().any():
        return None
    cells = results.cells_by_threads()
    cells = cells[cells["status"] != "unsupported"]
    plain = cells[(cells["variant"] == "") & (cells["verdict"] == "within")]
    both = cells[cells["variant"] != ""].merge(plain, on=KEYS, suffixes=("", "_plain"))
    if both.empty:
        return None
    both["ratio"] = (both["load_case_s"] / both["load_case_s_plain"]).where(both["verdict"] == "within")
    lines = [_line(both[both["method"] == method]) for method in in_order(both, "method")]
    columns = [
        word("solver (form), variant", "method"),
        number("scenes", "scenes", whole),
        number("within", "within", whole),
        Column("times as long", spread("ratio")),
        number("iterations", "iterations", whole),
        number("of the whole", "iterations_plain", whole),
        number("largest error, mm", "displacement_error_mm"),
    ]
    caption = (
        "*One ingredient left out or exchanged*: seconds a load case to those of the solver as it is, on the "
        "same scene with as many threads; the median over the scenes within the limit, and the least to the "
        "most. Iterations: medians."
    )
    return Section(
        "What each ingredient is worth", [Table("ingredients", caption, pd.DataFrame(lines), columns)]
    )


def _line(group: pd.DataFrame) -> dict[str, Any]:
    return {
        "method": group["method"].iloc[0],
        "scenes": group["scene"].nunique(),
        "within": int((group["verdict"] == "within").sum()),
        "ratio": group["ratio"].median(),
        "ratio_least": group["ratio"].min(),
        "ratio_most": group["ratio"].max(),
        "iterations": group["iterations"].median(),
        "iterations_plain": group["iterations_plain"].median(),
        "displacement_error_mm": group["displacement_error_mm"].max(),
    }
