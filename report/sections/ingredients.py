"""Ablation: a solver without one of its ingredients, relative to the complete solver."""

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
    """For solvers measured both complete and as variants, in a run with machine benchmarks."""
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
        Column("time relative to the complete solver", spread("ratio")),
        number("iterations", "iterations", whole),
        number("complete", "iterations_plain", whole),
        number("largest error, mm", "displacement_error_mm"),
    ]
    caption = (
        "*One ingredient omitted or replaced*: seconds per load case relative to the complete solver on the "
        "same scene with as many threads; the median over the scenes within the limit, and in brackets the "
        "range. Iterations: medians."
    )
    return Section(
        "What each ingredient contributes", [Table("ingredients", caption, pd.DataFrame(lines), columns)]
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
