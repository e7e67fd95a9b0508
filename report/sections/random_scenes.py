"""Scenes drawn at random: every solve time, worst cases beside medians, failures.

Those of superelements, each of a size of its own, have a table with preparation: their seconds of all steps,
and these relative to the fastest textbook method on the same scene.
"""

from typing import Any

import numpy as np
import pandas as pd

from harness.results.schema import ANSWERED, DRAWN, SPARSE
from report.analysis.standings import best_tolerances, shown
from report.document.blocks import Block, Column, Figure, Section, Table, number, word
from report.document.numbers import counted, power, whole
from report.figures import style
from report.figures.line_charts import against_contacts, entries, styles_of
from report.results.reader import Results
from report.results.rows import in_order

PANEL = 3.0  # inches
SUPERELEMENTS = f"{DRAWN}superelements/"
OF_METHOD = [
    word("solver (form)", "method"),
    number("scenes", "scenes", whole),
    number("solved and within", "within", whole),
    number("median, s", "median_s"),
    number("worst, s", "worst_s"),
]
WORST = word("worst scene", "worst_scene")


def section(results: Results) -> Section | None:
    """Every method with the best of its tolerances on each scene."""
    cells = results.cells[~results.cells["scene"].str.startswith(SPARSE)]
    cells = cells[cells["status"] != "unsupported"].dropna(subset=["n", "tolerance"])
    if cells.empty or cells["case"].notna().any():  # load cases of a series have a section of their own
        return None
    seconds = (cells["setup_s"].fillna(0.0) + cells["solve_s"]).where(cells["verdict"].isin(ANSWERED))
    good = (cells["status"] == "solved") & (cells["verdict"] == "within")
    cells = best_tolerances(cells.assign(load_case_s=seconds, good=good))
    superelements = cells["scene"].str.startswith(SUPERELEMENTS)
    blocks: list[Block] = []
    if len(sized := cells[~superelements]):
        run, often = sized[sized["status"] != "not_run"], shown(sized)
        if len(often):
            blocks.append(_figure(often, ", of the methods run on at least half of the scenes"))
        elif len(run):
            blocks.append(_figure(run))
        blocks.append(_times(sized, results.limit))
    if superelements.any():
        blocks.append(_to_textbook(cells[superelements], results.limit))
    if not cells["good"].all():
        blocks.append(_failures(cells[~cells["good"]]))
    return Section("Scenes drawn at random", blocks)


def _figure(cells: pd.DataFrame, whose: str = "") -> Figure:
    dots = {"markersize": 6.0, "markeredgewidth": 0.8, "linestyle": ""}
    styles = {name: look | dots for name, look in styles_of(cells).items()}
    drawing, panels = style.panels(cells["n"].nunique(), PANEL, entries(cells, styles))
    for axes, (n, of_size) in zip(panels, cells.groupby("n"), strict=True):
        against_contacts(axes, of_size, styles)
        axes.set_title(f"n = {n:.0f}, {counted(of_size['scene'].nunique(), 'scene')}", pad=5)
    axes.set_xlabel("closed contacts")
    caption = f"*Seconds of every solve* (set-up + solve) against the closed contacts{whose}."
    return Figure("drawn", caption, drawing)


def _times(cells: pd.DataFrame, limit: str) -> Table:
    lines = []
    for n, of_size in cells.groupby("n"):
        for method in in_order(of_size, "method"):
            mine = of_size[of_size["method"] == method]
            good = mine[mine["good"]].sort_values("load_case_s")
            line: dict[str, Any] = {"n": n, "method": method, "scenes": len(mine), "within": len(good)}
            line |= {"median_s": good["load_case_s"].median(), "worst_s": good["load_case_s"].max()}
            line |= {"worst_to_median": line["worst_s"] / line["median_s"]}
            lines.append(line | {"worst_scene": good["scene"].iloc[-1] if len(good) else ""})
    columns = [number("n", "n", whole), *OF_METHOD, number("worst / median", "worst_to_median"), WORST]
    caption = f"*Medians and worst cases* of the answers that are reported solved and within {limit}."
    return Table("drawn", caption, pd.DataFrame(lines), columns, keys=2)


def _to_textbook(cells: pd.DataFrame, limit: str) -> Table:
    """A scene that a method misses counts as infinitely slow; one that the textbook misses, not at all."""
    once = cells[["convert_s", "prepare_s"]].sum(axis=1)
    seconds = (once + cells["load_case_s"]).where(cells["good"], np.inf)
    textbook = seconds.where((cells["owner"] == "textbook") & cells["good"])
    ratio = seconds / textbook.groupby(cells["scene"]).transform("min")
    cells, lines = cells.assign(seconds=seconds, ratio=ratio).sort_values("ratio"), []
    for method in in_order(cells, "method"):
        mine = cells[cells["method"] == method]
        compared = mine.dropna(subset=["ratio"])
        line = {"method": method, "scenes": len(mine), "within": int(mine["good"].sum())}
        line |= {"median_s": mine["seconds"].median(), "worst_s": mine["seconds"].max()}
        line |= {"median_ratio": compared["ratio"].median(), "worst_ratio": compared["ratio"].max()}
        lines.append(line | {"worst_scene": compared["scene"].iloc[-1] if len(compared) else ""})
    ratios = number("to textbook, median", "median_ratio"), number("to textbook, worst", "worst_ratio")
    columns = [*OF_METHOD, *ratios, WORST]
    caption = (
        f"*Joints of superelements, preparation included*: answers that are solved and within {limit}, and "
        "their times relative to the fastest textbook method's; –: an answer is missing."
    )
    return Table("drawn-superelements", caption, pd.DataFrame(lines), columns)


def _failures(cells: pd.DataFrame) -> Table:
    columns = [
        word("scene", "scene"),
        word("solver (form)", "method"),
        Column("status", lambda line: str(line["status"]).replace("_", " "), "left"),
        Column("verdict", lambda line: str(line["verdict"]).replace("_", " "), "left"),
        number("closed contacts", "active", whole),
        number("error, mm", "displacement_error_mm", power),
        number("s", "load_case_s"),
    ]
    names = ["scene", "method", "tolerance", "status", "verdict"]
    names += ["active", "displacement_error_mm", "load_case_s"]
    caption = "*Not solved, or not within the limit.*"
    return Table("drawn-failures", caption, cells.sort_values(["n", "scene", "method"])[names], columns)
