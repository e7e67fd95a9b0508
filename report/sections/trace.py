"""Error against time within a solve, from runs that were stopped after 1, 2, 4, … iterations."""

import numpy as np
import pandas as pd

from report.analysis.standings import with_errors
from report.document.blocks import Figure, Section
from report.figures import style
from report.figures.line_charts import styles_of
from report.results.reader import Results
from report.results.rows import named

HEIGHT = 3.6  # inches
LIMITED = r" ?stopped at \d+$"  # the end of a variant
KEPT = [
    "scene",
    "label",
    "iteration_limit",
    "iterations",
    "total_s",
    "displacement_error_mm",
    "status",
    "verdict",
]
CAPTION = (
    "*Error against time within a solve*. Each mark is a run of its own, stopped after 1, 2, 4, … iterations "
    "of the solver, the last one not at all. Seconds with preparation; grey: the limit. Solvers differ in "
    "what an iteration is; one that finishes on a set of contacts falls at its end."
)


def section(results: Results) -> Section | None:
    lines = traces(results.cells)
    if lines.empty:
        return None
    scenes, styles = [*lines.groupby("scene", sort=False)], styles_of(lines)
    drawing, panels = style.panels(len(scenes), HEIGHT, style.legend_entries(styles))
    for axes, (scene, of_scene) in zip(panels, scenes, strict=True):
        for _, line in of_scene.groupby("label"):
            axes.plot(line["total_s"], line["error"], **styles[line["method"].iloc[0]])
        axes.axhline(of_scene["limit_mm"].max(), color=style.GREY, linewidth=1.0, zorder=0.5)
        axes.set(xscale="log", yscale="log", title=scene, xlabel="s", ylabel="displacement error, mm")
        style.plain_log(axes.xaxis)
    return Section("Error within a solve", [Figure("trace", CAPTION, drawing, lines[KEPT])])


def traces(cells: pd.DataFrame) -> pd.DataFrame:
    """The stopped runs and those that end them, by `label` without the limit, with a finite `error`, mm. Runs
    that did not stop at their limit are left out: they are as the whole one.
    """
    cells = named(cells.assign(variant=cells["variant"].str.replace(LIMITED, "", regex=True)))
    stopped = cells.groupby(["scene", "label"])["iteration_limit"].transform("count")
    lines = with_errors(cells[stopped > 0])
    lines = lines[np.isfinite(lines["error"]) & ~(lines["iterations"] > lines["iteration_limit"])]
    return lines.sort_values(["n", "scene", "label", "iteration_limit"], ignore_index=True)
