"""The rows of a results directory for the page: its cells with all that distinguishes and judges them.

The page gives the verdicts itself, for any limit L, from the cell's error and reference error bound:

    cannot be judged    unless bound ≤ max(L, least) / 10
    within              if error ≤ max(L, least), else outside

with `least` the limit that conditioning allows on a rung of a ladder, where it is above the one asked for. At
the limit of the rows these are the judge's verdicts.
"""

from __future__ import annotations

from typing import Any

import pandas as pd

from harness.results.schema import LADDERS
from report.analysis.checks import warnings
from report.analysis.time_to_solution import STAGES, roads
from report.document.blocks import records
from report.document.numbers import listed
from report.figures.style import line_styles
from report.page.write import Data, banner, column
from report.results.reader import Results
from report.results.rows import CELL, in_order

from .maps import scene_maps

TEXTS = (
    *("scene", "method", "label", "solver", "owner", "form", "variant", "status", "verdict", "machine"),
    *("message", "solver_version", "solver_code", "commit", "recorded_at", "key"),
)
NUMBERS = (
    *("n", "m", "active", "tolerance", "threads", "repeats", "iterations", "inner_iterations"),
    *("load_case_s", "least_s", "most_s", "once_s", "scene_s", "peak_rss_mib", "time_limit_s"),
    *("displacement_error_mm", "bound_mm", "least_mm", "backward_error", "contact_mismatch"),
)
LIMIT_MM = 1e-7  # of rows that do not say


def run_data(results: Results) -> Data:
    """What the page of a results directory shows."""
    cells = _cells(results)
    asked = cells["limit_asked_mm"].dropna()
    return {
        "kind": "run",
        "limit": float(asked.mode().iloc[0]) if len(asked) else LIMIT_MM,
        "banner": _banner(results),
        "order": in_order(cells) if len(cells) else [],
        "styles": {name: _look(style) for name, style in line_styles(cells).items()},
        "scenes": _scenes(results),
        "cells": {
            **{name: column(cells[name]) for name in (*TEXTS, *NUMBERS)},
            "options": column(cells["options"].map(_options)),
        },
        "maps": scene_maps(results),
    }


def _cells(results: Results) -> pd.DataFrame:
    """The cells without the forms that a solver does not take, with the limits and seconds from the scene."""
    cells = results.cells[results.cells["status"] != "unsupported"]
    cells = cells.rename(columns={"reference_bound_mm": "bound_mm"})
    lines = roads(results)
    if len(lines):
        lines = lines.assign(scene_s=lines[list(STAGES)].sum(axis=1, skipna=False))
        cells = cells.merge(lines[[*CELL, "scene_s"]], on=CELL, how="left")
    else:
        cells = cells.assign(scene_s=float("nan"))
    eased = cells["scene"].str.startswith(LADDERS) & (cells["limit_mm"] > cells["limit_asked_mm"])
    cells = cells.assign(least_mm=cells["limit_mm"].where(eased))
    return cells if "options" in cells else cells.assign(options=None)


def _options(options: object) -> str:
    given = options if isinstance(options, dict) else {}
    return ", ".join(f"{name} = {value}" for name, value in given.items())


def _look(style: dict[str, Any]) -> dict[str, str]:
    """Colour, marker and dashes of a method, as in the report's figures."""
    dashes = style["linestyle"]
    return {
        "color": style["color"],
        "face": style["markerfacecolor"],
        "marker": style["marker"],
        "dash": "" if isinstance(dashes, str) else " ".join(f"{2 * length:g}" for length in dashes[1]),
    }


def _banner(results: Results) -> Data:
    rows = results.rows
    versions = rows[rows["solver_version"] != ""].groupby("solver")["solver_version"].unique()
    again = f", {results.left_out} of them measured again or in search of a tolerance"
    return banner(
        rows,
        counts=f"{len(rows) + results.left_out} rows{again if results.left_out else ''}",
        versions=[f"{solver} {listed(sorted(found))}" for solver, found in versions.items()],
        warnings=warnings(results),
    )


def _scenes(results: Results) -> list[Data]:
    """The scenes in the order of the suite, on ladders, else by size and active contacts."""
    facts = {problem.get("scene"): problem for problem in records(results.problems)}
    found = results.cells.drop_duplicates("scene")
    names = list(found["scene"])
    ordered = list(found.sort_values(["n", "active", "scene"])["scene"])
    if all(name.startswith(LADDERS) for name in names):
        ordered = [name for name in results.suite.get("scenes", []) if name in set(names)]
    sizes = found.set_index("scene")[["n", "m", "active"]]
    return [
        {
            "scene": name,
            "title": str(facts.get(name, {}).get("title") or ""),
            "ladder": name.split("/")[1] if name.startswith(LADDERS) else "",
            **{size: None if pd.isna(value) else int(value) for size, value in sizes.loc[name].items()},
        }
        for name in dict.fromkeys([*ordered, *names])
    ]
