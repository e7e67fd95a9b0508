"""The style of the lines, the same in all figures of one report."""

from __future__ import annotations

from typing import Any

import pandas as pd

from report.analysis.drawn import drawn_cells
from report.analysis.precision import curves
from report.results.labels import in_order
from report.results.reader import Results

from . import style


def styles_of(results: Results, cells: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """The styles of the methods of some drawn cells."""
    styles = style.line_styles(drawn_cells(results))
    return {method: styles[method] for method in in_order(cells, "method")}


def looks(results: Results, cells: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """The styles of the methods of some drawn cells; those without a curve there have markers only."""
    joined = curves(cells)
    styles = styles_of(results, cells)
    return {s: look if s in joined else style.marker_only(look) for s, look in styles.items()}
