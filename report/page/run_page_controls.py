"""The lists and the slider above the views of a results directory."""

import math

import pandas as pd

from report.page.page_file import Data, choice

JUDGED = "ladders matrix precision solver"  # the views with a limit and filters
METRICS = {
    "load_case_s": "seconds per load case",
    "total_s": "seconds with preparation",
    "scene_s": "seconds from the scene",
    "over": "error / limit",
}
VERDICTS = {
    "within": "within",
    "outside": "outside the limit",
    "cannot_be_judged": "cannot be judged",
    "no_answer": "no answer",
}
FILTERS = {
    "machine": "machine",
    "n": "size n",
    "contact": "contact",
    "form": "form",
    "threads_asked": "threads",
    "owner": "solvers",
    "tolerance": "tolerance",
    "ladder": "ladder",
    "status": "reported",
}
ALL = ("", "all")


def ways_to_show(cells: pd.DataFrame, only_ladders: bool, methods: list[str]) -> list[Data]:
    """The lists that choose the figure of a cell, the lines of the matrix, its baseline, and one solver."""
    metrics = {name: text for name, text in METRICS.items() if name == "over" or cells[name].notna().any()}
    if only_ladders:
        metrics = {"over": metrics["over"]} | metrics
    named = [("", "–"), *((method, method) for method in methods)]
    lines = [("method", "best tolerance only"), ("label", "every tolerance")]
    return [
        choice("metric", "show", metrics.items(), JUDGED),
        choice("lines", "lines", lines, "matrix ladders"),
        choice("base", "ratios to", named, "matrix"),
        choice("solver", "solver", named, "solver precision"),
    ]


def limit_slider(limit_mm: float) -> Data:
    """The slider of the limit, from about 1e-3 to 1e-12 mm, one of whose steps is the limit of the rows."""
    exponent = -math.log10(limit_mm)
    return {"value": exponent, "least": 3 + exponent % 0.5}


def row_filters(cells: pd.DataFrame) -> list[Data]:
    """The lists that leave out cells. One machine is always chosen: machines are never mixed."""
    filters = [choice("judged", "verdict", [ALL, *VERDICTS.items()], JUDGED)]
    for name, label in FILTERS.items():
        values = sorted(set(cells[name].dropna()) - {""})
        texts = [f"{value:.10g}" if isinstance(value, float) else str(value) for value in values]
        options = list(zip(texts, texts, strict=True))
        if len(options) > 1:
            filters.append(choice(name, label, options if name == "machine" else [ALL, *options], JUDGED))
    return filters
