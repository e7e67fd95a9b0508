"""Many load cases on one assembly, which share the cost of conversion and preparation."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import pandas as pd
from matplotlib.figure import Figure as Drawing

from report.analysis.drawn import middle_scenes
from report.analysis.precision import ACCURACIES, in_view, judged, pareto, settings, swept
from report.document.blocks import Column, Figure, Place, Section, Table, number
from report.document.numbers import MISSING, counted, significant, tidy_power, whole
from report.figures import style
from report.figures.lines import looks
from report.figures.pareto_front import staircase
from report.results.reader import Results

PLACE = Place(380)

LOAD_CASES = (1, 10, 100, 1000)
PANEL = 2.6  # inches


def section(results: Results) -> Section | None:
    cells = swept(results)
    answered = in_view(cells[cells["scene"].isin(middle_scenes(results))].dropna(subset=["error"]))
    if answered.empty:
        return None
    caption = (
        f"*One load case, and one of {LOAD_CASES[-1]} on the same assembly*, on the middle scene of each "
        "size: seconds per load case against the achieved error. Left: one load case pays for the solver's "
        f"own conversion and preparation; right: {LOAD_CASES[-1]} load cases share them. Neither includes "
        "the Cholesky factor of K and Q, which the dense forms share."
    )
    figure = Figure("amortised", caption, _drawing(results, answered))
    return Section("Many load cases on one assembly", [figure, _table(cells)])


def _drawing(results: Results, answered: pd.DataFrame) -> Drawing:
    scenes, ends = answered["scene"].unique(), (LOAD_CASES[0], LOAD_CASES[-1])
    styles = looks(results, answered)
    drawing = style.figure_above(PANEL * len(scenes) + 0.3, style.legend_entries(styles))
    panels = drawing.subplots(len(scenes), len(ends), sharex=True, sharey="row", squeeze=False)
    low, high = answered["error"].min(), answered["error"].max()
    panels[0, 0].set(xscale="log", xlim=(low / 4, high * 4))
    for line, scene in zip(panels, scenes, strict=True):
        points = answered[answered["scene"] == scene]
        for axes, load_cases in zip(line, ends, strict=True):
            shown = points.assign(cost=points["load_case_s"] + points["once_s"] / load_cases)
            for method, look in styles.items():
                curve = shown[shown["method"] == method].sort_values("tolerance", ascending=False)
                axes.plot(curve["error"], curve["cost"], **look)
            axes.set_yscale("log")
            axes.set_title(f"n = {points['n'].iloc[0]:.0f}, {counted(load_cases, 'load case')}")
        for axes, load_cases in zip(line, ends, strict=True):
            cost = points["load_case_s"] + points["once_s"] / load_cases
            staircase(axes, pareto(points.assign(cost=cost), "cost"), "cost")
        line[0].set_ylabel("time per load case, s")
        style.plain_log(line[0].yaxis)
    for axes in panels[-1]:
        axes.set_xlabel("displacement error, mm (max norm)")
    return drawing


def _table(cells: pd.DataFrame) -> Table:
    lines = [_line(of_size, accuracy) for _, of_size in cells.groupby("n") for accuracy in ACCURACIES]
    columns = [number("n", "n", whole), number("error ≤, mm", "accuracy_mm", tidy_power)]
    columns += [Column(counted(k, "load case"), partial(_shown, load_cases=k), "left") for k in LOAD_CASES]
    caption = (
        "*The fastest settings by the number of load cases on one assembly*, with the seconds per load case "
        "including its share of conversion and preparation: the geometric mean over the scenes of the size, "
        "for settings that reach the error on all of them."
    )
    return Table("amortised", caption, pd.DataFrame(lines), columns)


def _line(cells: pd.DataFrame, accuracy: float) -> dict[str, Any]:
    line: dict[str, Any] = {"n": cells["n"].iloc[0], "accuracy_mm": accuracy}
    line["judged"] = judged(cells, accuracy)
    for load_cases in LOAD_CASES:
        seconds = settings(cells, accuracy, load_cases) if line["judged"] else pd.Series(dtype=float)
        line[f"fastest_{load_cases}"] = str(seconds.index[0]) if len(seconds) else ""
        line[f"seconds_{load_cases}"] = float(seconds.iloc[0]) if len(seconds) else None
    return line


def _shown(line: Mapping[str, Any], load_cases: int) -> str:
    if not line["judged"]:
        return "cannot be judged"
    name = line[f"fastest_{load_cases}"]
    return f"{name}: {significant(line[f'seconds_{load_cases}'])} s" if name else MISSING
