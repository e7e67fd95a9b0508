"""The looks of the lines in the figures of one report."""

from __future__ import annotations

from typing import Any

import pandas as pd

from report.analysis.drawn import drawn
from report.analysis.precision import curves
from report.results.labels import in_order
from report.results.reader import Results

from . import style


def styles_of(results: Results, cells: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """The looks of the method in some of the cells drawn, the same in every figure of a report."""
    styles = style.line_styles(drawn(results))
    return {method: styles[method] for method in in_order(cells, "method")}


def looks(results: Results, cells: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """The looks of the method in some of the cells drawn: those without a curve there are marks alone."""
    joined = curves(cells)
    styles = styles_of(results, cells)
    return {s: look if s in joined else style.marker_only(look) for s, look in styles.items()}
