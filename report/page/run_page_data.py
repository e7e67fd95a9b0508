"""Collects what the page of a results directory shows: its cells with all that distinguishes and judges them.

The page gives the verdicts itself, for any limit L, from the cell's error and reference error bound:

    cannot be judged    unless bound ≤ max(L, least) / 10
    within              if error ≤ max(L, least), else outside

with `least` the limit that conditioning allows on a rung of a ladder, where it is above the one asked for. At
the limit of the rows these are the judge's verdicts.
"""

from __future__ import annotations

import math
from typing import Any

import pandas as pd

from harness.results.schema import LADDERS
from report.analysis.checks import warnings
from report.analysis.time_to_solution import STAGES, stage_seconds
from report.document.blocks import records
from report.document.numbers import counted, listed
from report.figures.style import line_styles
from report.page.contact_maps import map_view, scene_maps
from report.page.page_figures import PANELS, item, precision_figure
from report.page.page_file import Data, banner, column
from report.page.run_page_controls import limit_slider, row_filters, ways_to_show
from report.results.reader import Results
from report.results.rows import CELL, in_order

TEXTS = (
    *("scene", "method", "label", "solver", "owner", "form", "variant", "settings", "status", "verdict"),
    *("machine", "title", "ladder", "contact", "message", "solver_version", "solver_code"),
    *("commit", "recorded_at", "device", "log", "key"),
)
NUMBERS = (
    *("n", "m", "active", "tolerance", "threads", "threads_asked", "repeats", "iterations"),
    *("inner_iterations", "load_case_s", "least_s", "most_s", "total_s", "scene_s", "peak_rss_mib"),
    *("time_limit_s", "displacement_error_mm", "reached_mm", "bound_mm", "least_mm", "backward_error"),
    "contact_mismatch",
)
LIMIT_MM = 1e-7  # of rows that do not say
CONTACT = {"up to 10 %": 0.1, "10 to 50 %": 0.5, "above 50 %": 1.0}
#: By matplotlib's marker, Bokeh's of about the same shape, its turn, and a character like it.
MARKERS = {
    "o": ("circle", 0, "●"),
    "s": ("square", 0, "■"),
    "*": ("star", 0, "★"),
    "D": ("diamond", 0, "◆"),
    "d": ("diamond_dot", 0, "◈"),
    "v": ("inverted_triangle", 0, "▼"),
    "<": ("triangle", 90, "◀"),
    ">": ("triangle", -90, "▶"),
    "P": ("plus", 0, "✚"),
    "X": ("plus", 45, "✖"),
    "p": ("square_dot", 0, "▣"),
    "h": ("hex", 0, "⬢"),
    "H": ("hex_dot", 0, "⬣"),
    "8": ("circle_dot", 0, "◉"),
}
DRAWN_MM = (1e-16, 1.0)  # errors of the view of work and precision
#: Columns of the view of one solver, after the verdict.
OF_ONE_SOLVER = {
    "scene": "scene",
    "tolerance": "tolerance",
    "settings": "options",
    "status": "reported",
    "displacement_error_mm": "error, mm",
    "over": "error / limit",
    "bound_mm": "bound, mm",
    "iterations": "steps",
    "load_case_s": "load case, s",
    "least_s": "least",
    "most_s": "most",
    "total_s": "with preparation, s",
    "slower": "× fastest",
    "threads": "threads",
    "peak_rss_mib": "peak, MiB",
}


def run_data(results: Results) -> Data:
    """The rows of a results directory, with the views, lists and figures of their page."""
    cells, scenes, maps = _cells(results), _scenes(results), map_view(scene_maps(results))
    limits = cells["limit_asked_mm"].dropna().mode()
    limit_mm = float(limits.iloc[0]) if len(limits) else LIMIT_MM
    ladders = [scene for scene in scenes if scene["ladder"]]
    methods = in_order(cells, "method") if len(cells) else []
    filters = row_filters(cells)
    views = {"ladders": "Ladders"} if ladders else {}
    views |= {"matrix": "Matrix", "precision": "Work and precision"}
    views |= {"solver": "One solver"} if methods else {}
    views |= dict(maps["views"])
    ranges = [_range(cells, ["reached_mm"]), _range(cells, ["load_case_s", "total_s", "scene_s"])]
    panel = precision_figure(*ranges)
    panels = [item(panel, f"panel-{k}") for k in range(min(PANELS, len(scenes)))]
    return {
        "banner": _banner(results),
        "views": list(views.items()),
        "limit": limit_slider(limit_mm),
        "limit_mm": limit_mm,
        "controls": [
            *ways_to_show(cells, len(ladders) == len(scenes), methods),
            *filters,
            *maps["controls"],
        ],
        "filters": [control["name"] for control in filters],
        "methods": methods,
        "columns": list(OF_ONE_SOLVER.items()),
        "styles": {name: _look(style) for name, style in line_styles(cells).items()},
        "scenes": scenes,
        "cells": {name: column(cells[name]) for name in (*TEXTS, *NUMBERS)},
        "maps": maps["maps"],
        "figures": maps["figures"] | {"panels": panels},
    }


def _range(cells: pd.DataFrame, names: list[str]) -> tuple[float, float]:
    """A range, with a margin, of positive values in some columns."""
    values = cells[names].to_numpy(dtype=float)
    values = values[values > 0]
    return (float(values.min()) / 2, float(values.max()) * 2) if len(values) else (0.1, 10.0)


def _cells(results: Results) -> pd.DataFrame:
    """The cells without the forms that a solver does not take, with the limits and seconds from the scene."""
    cells = results.about("whole").cells
    cells = cells[cells["status"] != "unsupported"]
    cells = cells.rename(columns={"reference_bound_mm": "bound_mm"})
    lines = pd.concat(map(stage_seconds, results.by_machine()))
    if len(lines):
        lines = lines.assign(scene_s=lines[list(STAGES)].sum(axis=1, skipna=False))
        cells = cells.merge(lines[[*CELL, "scene_s"]], on=CELL, how="left")
    else:
        cells = cells.assign(scene_s=float("nan"))
    eased = cells["scene"].str.startswith(LADDERS) & (cells["limit_mm"] > cells["limit_asked_mm"])
    reached = cells[["displacement_error_mm", "bound_mm"]].max(axis=1)
    judged = cells["displacement_error_mm"].notna() & (reached < math.inf)
    titles = {problem.get("scene"): str(problem.get("title") or "") for problem in records(results.problems)}
    share = pd.cut(cells["active"] / cells["m"], [-1.0, *CONTACT.values()], labels=list(CONTACT))
    return cells.assign(
        least_mm=cells["limit_mm"].where(eased),
        reached_mm=reached.clip(*DRAWN_MM).where(judged),
        total_s=cells["load_case_s"] + cells["once_s"].fillna(0.0),
        ladder=cells["scene"].map(_ladder),
        title=cells["scene"].map(lambda scene: titles.get(scene, "")),
        contact=share.cat.add_categories("").fillna("").astype(object),
    )


def _look(style: dict[str, Any]) -> Data:
    """Colours, marker and dashes of a method, as in the report's figures."""
    marker, turn, sign = MARKERS[style["marker"]]
    color, face, dashes = style["color"], style["markerfacecolor"], style["linestyle"]
    return {
        "color": color,
        "face": face,
        "marker": marker,
        "angle": math.radians(turn),
        "dash": "solid" if dashes == "-" else "dashed" if len(dashes[1]) == 2 else "dashdot",
        "sign": sign,
        "css": f"color: {face}; -webkit-text-stroke: 1px {color}",
    }


def _ladder(scene: str) -> str:
    return scene.split("/")[1] if scene.startswith(LADDERS) else ""


def _banner(results: Results) -> Data:
    rows = results.rows
    versions = rows[rows["solver_version"] != ""].groupby("solver")["solver_version"].unique()
    again = f", {results.left_out} of them measured again or in search of a tolerance"
    return banner(
        rows,
        counts=counted(len(rows) + results.left_out, "row") + (again if results.left_out else ""),
        versions=[f"{solver} {listed(sorted(found))}" for solver, found in versions.items()],
        warnings=warnings(results),
    )


def _scenes(results: Results) -> list[Data]:
    """The rungs of ladders in the order of the suite, then the scenes by size and active contacts."""
    cells = results.cells.drop_duplicates("scene").sort_values(["n", "active", "scene"])
    scenes = cells.set_index("scene")
    rungs = [name for name in results.suite.get("scenes", []) if _ladder(name) and name in scenes.index]
    return [
        {"scene": name, "ladder": _ladder(name), "heading": _heading(name, scenes.loc[name])}
        for name in dict.fromkeys([*rungs, *scenes.index])
    ]


def _heading(scene: str, sizes: pd.Series[Any]) -> str:
    """The ladder and the rung, or the scene with its share of closed contacts."""
    if _ladder(scene):
        return scene.split("/", 1)[1]
    share = sizes["active"] / sizes["m"] if sizes["m"] else math.nan
    return scene if math.isnan(share) else f"{scene} · {share:.0%}"
