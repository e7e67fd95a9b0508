"""The requested tolerance against the achieved error: whose tolerance can be trusted."""

from __future__ import annotations

from typing import Any

import pandas as pd
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import LogLocator

from report.analysis.precision import in_view, swept
from report.document.blocks import Figure, Place, Section, Table, number, word
from report.document.numbers import whole
from report.figures import style
from report.figures.lines import looks
from report.figures.overlaps import side_by_side
from report.results.labels import in_order, named
from report.results.reader import Results

PLACE = Place(350)

PANEL = 2.7  # inches


def section(results: Results) -> Section | None:
    cells = in_view(swept(results)).dropna(subset=["error", "tolerance"])
    if cells.empty:
        return None
    words = (
        "*Error against the requested tolerance*, the worst over the scenes of each size. Below the dotted "
        "diagonal the error is smaller than the tolerance. Solvers apply their tolerance to different "
        "quantities (a gap, a force, an energy), so only the slope matters: whether a line runs parallel to "
        "the diagonal, and where it levels off. Markers that would hide each other stand side by side. Runs "
        "without an answer are omitted."
    )
    columns = [
        word("solver (form)", "method"),
        number("reported solved", "solved", whole),
        number("error above the tolerance", "above_tolerance", whole),
        number("largest error / tolerance", "worst_ratio"),
        number(f"tolerance ≤ {results.limit.removesuffix(' mm')}", "tight", whole),
        number(f"of these, error > {results.limit}", "tight_outside", whole),
    ]
    caption = (
        "*Whose tolerance can be trusted*: the runs that the solver reported as solved, counting every "
        "repeat. The reference error bound is subtracted from the error, in the solver's favour."
    )
    figure = Figure("asked-achieved", words, _drawing(results, cells))
    table = Table("asked-achieved", caption, trust(results), columns)
    return Section("Requested tolerance and achieved error", [figure, table])


def _drawing(results: Results, cells: pd.DataFrame) -> Drawing:
    sizes, styles = sorted(cells["n"].unique()), looks(results, cells)
    drawing = style.figure(PANEL * len(sizes) + 0.4)
    panels = drawing.subplots(len(sizes), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    panels[0].set(xscale="log", yscale="log")
    panels[0].xaxis.set_major_locator(LogLocator(numticks=20))
    for axes, n in zip(panels, sizes, strict=True):
        worst = cells[cells["n"] == n].groupby(["method", "tolerance"], as_index=False)["error"].max()
        side_by_side(axes, worst, "tolerance", "error", styles)
        axes.axline((1e-6, 1e-6), (1e-5, 1e-5), color="black", linewidth=1.1, linestyle=(0, (1, 1.5)))
        axes.set(title=f"n = {n:.0f}", ylabel="displacement error, mm")
    panels[-1].set_xlabel("requested tolerance")
    drawing.legend(handles=style.legend_entries(styles), loc="outside right upper", handlelength=3.2)
    return drawing


def trust(results: Results) -> pd.DataFrame:
    """One line per method: of its runs reported as solved, how many exceed the tolerance, and how many
    exceed the limit although the tolerance was no larger.
    """
    rows = named(results.rows)
    said = (rows["status"] == "solved") & rows["displacement_error_mm"].notna() & (rows["tolerance"] > 0)
    rows = rows[said]
    error = (rows["displacement_error_mm"] - rows["reference_bound_mm"].fillna(0.0)).clip(lower=0.0)
    rows = rows.assign(ratio=error / rows["tolerance"], tight=rows["tolerance"] <= rows["limit_mm"])
    rows["broken"] = rows["tight"] & (error > rows["limit_mm"])
    lines: list[dict[str, Any]] = []
    for method in in_order(rows, "method"):
        runs = rows[rows["method"] == method]
        line = {"method": method, "solved": len(runs), "above_tolerance": int((runs["ratio"] > 1).sum())}
        line |= {"tight": int(runs["tight"].sum()), "tight_outside": int(runs["broken"].sum())}
        lines.append(line | {"worst_ratio": runs["ratio"].max()})
    return pd.DataFrame(lines)
