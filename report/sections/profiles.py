"""Performance profiles: Dolan and Moré, Mathematical Programming 91:201-213, 2002."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Drawing

from report.analysis.precision import judged, with_errors
from report.document.blocks import Figure, Section, Table, number, word
from report.document.numbers import counted, whole
from report.figures import style
from report.figures.lines import styles_of
from report.results.labels import in_order
from report.results.reader import Results

FEWEST = 5  # load cases
PLANNED = 0.75  # share of the scenes in the plan of a method, for it to be in a profile
FACTORS = {1.0: "fastest", 2.0: "τ ≤ 2", 10.0: "τ ≤ 10"}


def section(results: Results) -> Section | None:
    times = ratios(results.cells)
    if len(times) < FEWEST or len(times.columns) < 2:
        return None
    lines = pd.DataFrame({"method": times.columns, "load_cases": len(times)})
    lines["answered"] = np.isfinite(times).sum().to_numpy()
    columns = [word("solver (form)", "method"), number("load cases", "load_cases", whole)]
    columns.append(number(f"within {results.limit}", "answered", whole))
    for factor, heading in FACTORS.items():
        lines[f"within_{factor:g}"] = (times <= factor).sum().to_numpy()
        columns.append(number(heading, f"within_{factor:g}", whole))
    caption = (
        f"*Performance profiles over {counted(len(times), 'load case')}*: the share that a solver answers "
        f"within {results.limit}, with the best of its tolerances, in at most τ times the time of the "
        "fastest."
    )
    figure = Figure(
        "profiles", caption, _drawn(times, styles_of(results.cells[results.cells["method"].isin(times)]))
    )
    table = Table("profiles", "*The profiles in numbers*: load cases.", lines, columns)
    return Section("Performance profiles", [figure, table])


def ratios(cells: pd.DataFrame) -> pd.DataFrame:
    """Time over that of the fastest, by scene and method; infinite if the limit was not met. Compared are the
    methods planned for PLANNED of the scenes, on those planned for all of them, which the reference can judge
    and one answers.
    """
    cells = with_errors(cells[cells["status"] != "unsupported"])
    planned = cells.pivot_table(index="scene", columns="method", values="n", aggfunc="size").notna()
    often = planned.columns[planned.mean() >= PLANNED]
    common = planned.index[planned[often].all(axis=1)]
    cells = cells[cells["method"].isin(often) & cells["scene"].isin(common)]
    known = [scene for scene, of in cells.groupby("scene") if judged(of, of["limit_mm"].max())]
    good = cells[(cells["error"] <= cells["limit_mm"]) & cells["scene"].isin(known)]
    times = good.pivot_table(index="scene", columns="method", values="load_case_s", aggfunc="min")
    times = times.reindex(columns=in_order(cells, "method"))
    return times.div(times.min(axis=1), axis=0).fillna(np.inf)


def _drawn(times: pd.DataFrame, styles: dict[str, dict[str, Any]]) -> Drawing:
    right = max(2.0, 1.3 * float(times.where(np.isfinite(times)).max().max()))
    drawing, (axes,) = style.panels(1, 3.2, style.legend_entries(styles))
    for method, look in styles.items():
        met, counts = np.unique(times[method][np.isfinite(times[method])], return_counts=True)
        shares = counts.cumsum() / len(times)
        axes.plot(met, shares, **style.marker_only(look))
        taus, heights = np.array([1.0, *met, right]), np.array([0.0, *shares, shares.max(initial=0)])
        axes.plot(taus, heights, drawstyle="steps-post", **(look | {"marker": ""}))
    axes.set(xscale="log", xlim=(0.97, right), ylim=(-0.04, 1.06))
    axes.set(xlabel="τ: time over that of the fastest", ylabel="share of the load cases")
    style.plain_log(axes.xaxis)
    return drawing
