"""Performance profiles (Dolan and Moré, Mathematical Programming 91:201-213, 2002) at the limit."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Drawing

from report.analysis.drawn import omission_note, rare_variants
from report.analysis.precision import judged, with_errors
from report.document.blocks import Figure, Place, Section, Table, number, word
from report.document.numbers import counted, listed, whole
from report.figures import style
from report.figures.lines import styles_of
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(370)

FEWEST = 5  # load cases of a profile
MOST = 0.75  # share of the scenes in the plan of a method, for it to be compared
FACTORS = {1.0: "fastest", 2.0: "τ ≤ 2", 10.0: "τ ≤ 10"}


def section(results: Results) -> Section | None:
    cells = compared(results)
    times = ratios(cells)
    if len(times) < FEWEST or len(times.columns) < 2:
        return None
    others = asked(results)
    left = in_order(others[~others["method"].isin(times)], "method")
    caption = (
        f"*Performance profiles over {counted(len(times), 'load case')}*: the share that a solver answers "
        f"within {results.limit}, with the best of its tolerances, in at most τ times the time of the "
        "fastest. Left end: how often it is the fastest; right end: how many it answers at all. Failures, "
        "answers outside the limit and runs not started for lack of time count as never. Load cases are "
        "excluded if they are not in every solver's plan, if nothing answered them, or if the reference "
        "cannot judge the limit."
        + (f" In the plan for fewer than three quarters of the scenes: {listed(left)}." if left else "")
        + omission_note(results)
    )
    figure = Figure("profiles", caption, _drawing(results, times))
    return Section("Performance profiles", [figure, _table(times, results)])


def asked(results: Results) -> pd.DataFrame:
    """The cells of the plan without rare variants, including those not run for lack of time."""
    return results.cells[results.cells["status"] != "unsupported"].drop(rare_variants(results).index)


def compared(results: Results) -> pd.DataFrame:
    """The cells, with errors, of the methods planned for MOST of the scenes, on the scenes planned for all
    of these methods.
    """
    cells = asked(results)
    table = cells.pivot_table(index="scene", columns="method", values="n", aggfunc="size").notna()
    often = table.columns[table.mean() >= MOST]
    common = table.index[table[often].all(axis=1)]
    return with_errors(cells[cells["method"].isin(often) & cells["scene"].isin(common)])


def ratios(cells: pd.DataFrame) -> pd.DataFrame:
    """Time over that of the fastest, by scene and method; infinite if the limit was not met."""
    known = [s for s, of in cells.groupby("scene") if judged(of, of["limit_mm"].max())]
    good = cells[(cells["error"] <= cells["limit_mm"]) & cells["scene"].isin(known)]
    times = good.pivot_table(index="scene", columns="method", values="load_case_s", aggfunc="min")
    times = times.reindex(columns=in_order(cells, "method"))
    return times.div(times.min(axis=1), axis=0).fillna(np.inf)


def _drawing(results: Results, times: pd.DataFrame) -> Drawing:
    styles = styles_of(results, results.cells[results.cells["method"].isin(times)])
    right = 1.3 * float(times.where(np.isfinite(times)).max().max())
    drawing = style.figure(3.6)
    axes = drawing.subplots()
    for method, look in styles.items():
        met, counts = np.unique(times[method][np.isfinite(times[method])], return_counts=True)
        shares = counts.cumsum() / len(times)
        axes.plot(met, shares, **style.marker_only(look))
        taus, steps = np.array([1.0, *met, max(right, 2.0)]), np.array([0.0, *shares, shares.max(initial=0)])
        axes.plot(taus, steps, drawstyle="steps-post", **style.line_only(look))
    axes.set(xscale="log", xlim=(0.97, max(right, 2.0)), ylim=(-0.04, 1.06))
    axes.set(xlabel="τ: time over that of the fastest", ylabel="share of the load cases")
    style.plain_log(axes.xaxis)
    drawing.legend(handles=style.legend_entries(styles), loc="outside right upper", handlelength=3.2)
    return drawing


def _table(times: pd.DataFrame, results: Results) -> Table:
    lines = pd.DataFrame({"method": times.columns, "load_cases": len(times)})
    lines["answered"] = np.isfinite(times).sum().to_numpy()
    columns = [word("solver (form)", "method"), number("load cases", "load_cases", whole)]
    columns.append(number(f"within {results.limit}", "answered", whole))
    for factor, heading in FACTORS.items():
        lines[f"within_{factor:g}"] = (times <= factor).sum().to_numpy()
        columns.append(number(heading, f"within_{factor:g}", whole))
    return Table("profiles", "*The profiles in numbers*: load cases.", lines, columns)
