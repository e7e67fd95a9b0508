"""Methods for contact problems: seconds per load case and products with Q, scene by scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd

from report.analysis.standings import best_tolerances, seconds_text
from report.document.blocks import Column, Section, Table, records, word
from report.document.numbers import whole
from report.results.reader import Results
from report.results.rows import in_order

CAPTION = (
    "*Time and products with Q*: seconds per load case, and in brackets the products with Q per load case, "
    "where a method counts them. Of several tolerances, the fastest within the limit, else the least wrong. "
    "A lower bound where it ran out of time."
)


def section(results: Results) -> Section | None:
    """For results in which at least two methods count their products with Q."""
    cells = results.cells[results.cells["status"] != "unsupported"]
    cells = cells.assign(products=[_products(cell.get("details")) for cell in records(cells)])
    if cells.loc[cells["products"].notna(), "solver"].nunique() < 2:
        return None
    cells = best_tolerances(cells)
    scenes = list(cells.sort_values(["n", "active"])["scene"].unique())
    lines = [_line(cells[cells["method"] == method]) for method in in_order(cells, "method")]
    columns = [word("method", "method"), *(Column(scene, _shown(scene)) for scene in scenes)]
    table = Table("methods", CAPTION, pd.DataFrame(lines), columns)
    return Section("Methods for contact problems", [table])


def _products(details: object) -> float:
    found = details.get("products") if isinstance(details, Mapping) else None
    return float("nan") if found is None else float(found)


def _line(cells: pd.DataFrame) -> dict[str, Any]:
    line: dict[str, Any] = {"method": cells["method"].iloc[0]}
    for cell in records(cells):
        line[cell["scene"]] = seconds_text(cell)
        line[f"{cell['scene']} products"] = cell["products"]
    return line


def _shown(scene: str) -> Callable[[Mapping[str, Any]], str]:
    def text(line: Mapping[str, Any]) -> str:
        seconds, products = line[scene], line[f"{scene} products"]
        if not isinstance(seconds, str):
            return ""
        return seconds + (f" ({whole(products)})" if products == products else "")

    return text
