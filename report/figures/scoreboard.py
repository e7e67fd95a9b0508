"""The first figure of a report: every solver on every scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.figure import Figure

from report.document.blocks import records
from report.document.numbers import listed, power, significant, whole

from .grid import Cell, Group, grid

ROW = 0.26  # inches
WIDEST = 19.0  # columns
SLOWEST = 100.0  # times as long as the fastest of a scene: the pale end of the shading
SHORT = {"memory_limit": "memory", "iteration_limit": "iterations", "unsupported": "n/a"}


def explained(cells: pd.DataFrame, standings: pd.DataFrame, limit: str) -> str:
    """The caption of `scoreboard`, with the methods that it lacks."""
    words = (
        "*Every solver on every scene, the best first*, with its number of scenes within the limit; below "
        f"the columns: active contacts. Blue: within {limit}, seconds per load case, the darker, the closer "
        "to the fastest on the scene; hatched: outside, the error in mm; grey: no answer, and why; empty: "
        "not in the plan."
    )
    missing = sorted(set(standings["method"]) - set(cells["method"]))
    return words + (f" Run on fewer than half of the scenes: {listed(missing)}." if missing else "")


def scoreboard(cells: pd.DataFrame, standings: pd.DataFrame) -> Figure:
    """One row per method in the order of the standings, one column per scene by size and active contacts.

    cells : one per method and scene. Shades of blue: from the fastest of the scene to 100 times as long.
    """
    scenes = cells.drop_duplicates("scene").sort_values(["n", "active", "scene"])
    groups = [
        Group(f"n = {n:.0f}", dict(zip(of_size["scene"], map(whole, of_size["active"]), strict=True)))
        for n, of_size in scenes.groupby("n")
    ]
    lines = standings[standings["method"].isin(cells["method"])]
    rows = {
        line["method"]: f"{line['method']}   {line['within']} of {line['scenes']}" for line in records(lines)
    }
    within = cells["load_case_s"].where(cells["verdict"] == "within")
    cells = cells.assign(slower=within / within.groupby(cells["scene"]).transform("min"))
    found = {(cell["method"], cell["scene"]): _cell(cell) for cell in records(cells)}
    return grid(rows, groups, found, ROW, WIDEST)


def _cell(cell: Mapping[str, Any]) -> Cell:
    match cell["verdict"]:
        case "within":
            slow = min(1.0, math.log(cell["slower"]) / math.log(SLOWEST))
            face = mpl.colors.to_hex(mpl.colormaps["Blues"](0.88 - 0.78 * slow))
            return Cell(significant(cell["load_case_s"], 2), face, "white" if slow < 0.45 else "black")
        case "outside":
            return Cell(power(cell["displacement_error_mm"], 2), "white", "black", "//////")
        case "cannot_be_judged":
            return Cell("?", "#F1F1F1")
    if cell["status"] == "time_limit" and cell["time_limit_s"] > 0:
        return Cell(f"> {cell['time_limit_s']:.0f} s", "#F1F1F1")
    return Cell(SHORT.get(cell["status"], cell["status"].replace("_", " ")), "#F1F1F1")
