"""The seconds of each step on the way to an answer: from the scene on, or those of the solver alone."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import pandas as pd

from report.analysis.roads import LOAD_CASES, STAGES, roads
from report.analysis.seconds import seconds_text
from report.analysis.standings import best_tolerances, shown
from report.document.blocks import Block, Column, Figure, Section, Table, number, word
from report.document.numbers import counted, significant, whole
from report.figures import style
from report.figures.bars import Looks, stacked
from report.results.labels import in_order
from report.results.reader import Results

MADE = ("model_s", "K_s", "factors_s", "Q_s")  # before the solver's own preparation
FROM_SCENE: Looks = {
    "model_s": ("finite-element model", "#C9C9C9", None),
    "K_s": ("condensation", "#5A5A5A", None),
    "factors_s": ("factors of K", style.PURPLE, None),
    "Q_s": ("Q", style.VERMILLION, "xxxx"),
    "once_s": ("preparation", style.GREEN, None),
    "solving_s": ("set-up and solve", style.BLUE, None),
    "recovery_s": ("p and x of the dual", style.SKY, "...."),
}
STEPS: Looks = {
    "convert_s": ("convert", "#B8B8B8", None),
    "prepare_s": ("prepare, once per assembly", style.GREEN, None),
    "setup_s": ("set up", style.ORANGE, "////"),
    "solve_s": ("solve", style.BLUE, None),
    "form_s": ("p and x of the dual", style.SKY, "...."),
}


def from_scene(results: Results) -> Section | None:
    """The seconds of every stage, in a run with sparse and dense forms."""
    lines = roads(results)
    if lines.empty:
        return None
    order = in_order(lines)
    table = lines.assign(place=lines["label"].map(order.index), made_s=lines[[*MADE]].sum(axis=1))
    table = table.sort_values(["n", "active", "scene", "total_1_s", "place"])
    kept = ["scene", "n", "m", "active", "label", "threads", "tolerance", "status", "verdict"]
    kept += [*STAGES, "made_s", *(f"total_{k}_s" for k in LOAD_CASES)]
    kept += ["stored_mib", "peak_rss_mib", "load_case_s", "time_limit_s"]
    columns = [word("scene", "scene"), word("solver (form)", "label"), number("matrices, s", "made_s")]
    columns += [Column(f"{counted(k, 'load case')}, s", partial(_total, load_cases=k)) for k in LOAD_CASES]
    columns += [
        number("dense matrices, MiB", "stored_mib", whole),
        number("peak, MiB", "peak_rss_mib", whole),
    ]
    caption = (
        "*From the scene to the answer*, medians of the repeats, totals of several load cases extrapolated. "
        "Cached matrices count with the seconds that they took to make."
    )
    blocks: list[Block] = [Table("roads", caption, table[kept], columns, keys=2)]
    answered = _at_the_ends(best_tolerances(lines[lines["total_1_s"].notna()]))
    answered = answered[answered.groupby("scene")["method"].transform("nunique") > 1]
    if len(answered):
        caption = (
            "*From the scene to the answer of one load case*, the fastest first, in seconds; of each size, "
            "the scenes with the fewest and the most active contacts."
        )
        blocks.insert(0, Figure("roads", caption, stacked(answered, "total_1_s", FROM_SCENE)))
    return Section("From scene to answer", blocks)


def _total(line: Mapping[str, Any], load_cases: int) -> str:
    if line["verdict"] == "within":
        return significant(line[f"total_{load_cases}_s"])
    return seconds_text(line) if load_cases == LOAD_CASES[0] else ""


def _at_the_ends(cells: pd.DataFrame) -> pd.DataFrame:
    """Of each size the scenes with the fewest and the most active contacts."""
    scenes = cells.drop_duplicates("scene").sort_values(["n", "active", "scene"]).groupby("n")["scene"]
    return cells[cells["scene"].isin([*scenes.first(), *scenes.last()])]


def steps(results: Results) -> Section | None:
    """Where no stage before the solver is known: the solver's own steps."""
    cells = best_tolerances(shown(results.cells))
    cells = _at_the_ends(cells[(cells["verdict"] == "within") & (cells["total_s"] > 0)])
    if cells.empty or len(roads(results)):
        return None
    caption = (
        "*Where the time goes*, within the limit, the fastest first; of each size, the scenes with the "
        "fewest and the most active contacts. The factor of K and Q, which the dense forms share, are not "
        "included."
    )
    return Section("Where the time goes", [Figure("time-steps", caption, stacked(cells, "total_s", STEPS))])
