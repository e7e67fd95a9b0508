"""How time and memory grow with the size: exponents in n for one joint on finer and finer grids."""

from __future__ import annotations

from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from report.analysis.fit import exponent
from report.analysis.seconds import seconds_text
from report.document.blocks import Column, Figure, Place, Section, Table, number, records, word
from report.document.numbers import MISSING, whole
from report.figures import style
from report.figures.lines import styles_of
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(160)

FEWEST = 3  # sizes
#: What grows, and its unit.
GROWING = {
    "load_case_s": "seconds per load case",
    "once_s": "seconds of preparation per assembly",
    "working_mib": "working memory, MiB",
}
SHORTEST = {
    "load_case_s": 1e-2,
    "once_s": 1e-2,
    "working_mib": 8.0,
}  # smaller values do not reflect the size of Q


def section(results: Results) -> Section | None:
    """For the scenes scaling/…, in a run with machine benchmarks."""
    cells = results.cells[results.cells["scene"].str.startswith("scaling/")]
    if not cells["cholesky_s"].notna().any() or cells["n"].nunique() < FEWEST:
        return None
    return Section(
        "Scaling with the problem size", [_exponents(cells), _figures(cells), _figure(results, cells)]
    )


def _exponents(cells: pd.DataFrame) -> Table:
    within = cells[cells["verdict"] == "within"]
    lines: list[dict[str, Any]] = []
    for method in in_order(within, "method"):
        mine = within[within["method"] == method].sort_values("n")
        line: dict[str, Any] = {"method": method, "sizes": len(mine), "largest": mine["n"].max()}
        for name in GROWING:
            fit = exponent(mine["n"].tolist(), _fitted(mine, name).tolist())
            line |= {name: fit and fit.slope, f"{name}_shown": str(fit) if fit else MISSING}
        lines.append(line)
    once = within.dropna(subset=["cholesky_s"]).drop_duplicates("scene")  # not timed in the sparse form
    for name, what in (("cholesky_s", "one Cholesky of Q"), ("product_s", "one product Qv")):
        fit = exponent(once["n"].tolist(), once[name].tolist())
        lines.append({"method": what, "sizes": len(once), "largest": once["n"].max()})
        lines[-1] |= {"load_case_s": fit and fit.slope, "load_case_s_shown": str(fit) if fit else MISSING}
    columns = [
        word("solver (form)", "method"),
        number("sizes", "sizes", whole),
        number("largest n", "largest", whole),
        *(Column(f"exponent of {what}", _shown(name)) for name, what in GROWING.items()),
    ]
    caption = (
        "*Exponents in n*: the slope of a straight line in log–log, with its standard error. Only answers "
        "within the limit count. Working memory: the largest resident memory minus that resident after "
        "loading the data. Times below 10 ms and memory below 8 MiB are excluded."
    )
    return Table("scaling-exponents", caption, pd.DataFrame(lines), columns)


def _fitted(mine: pd.DataFrame, name: str) -> pd.Series:
    return mine[name].where(mine[name] >= SHORTEST[name], 0.0)


def _shown(name: str) -> Any:
    return lambda line: line[f"{name}_shown"] if isinstance(line.get(f"{name}_shown"), str) else MISSING


def _figures(cells: pd.DataFrame) -> Table:
    names = in_order(cells, "method")
    table = cells.assign(place=cells["method"].map(names.index)).sort_values(["n", "place"])
    table = table.assign(seconds=[seconds_text(cell) for cell in records(table)])
    table["q_mib"] = 8 * table["m"] ** 2 / 2**20
    columns = [
        number("n", "n", whole),
        number("m", "m", whole),
        number("active", "active", whole),
        word("solver (form)", "method"),
        word("s per load case", "seconds"),
        number("per assembly, s", "once_s"),
        number("Cholesky of Q, s", "cholesky_s"),
        number("working memory, MiB", "working_mib", whole),
    ]
    caption = "*The data of the fits*, medians of the repeats. >: stopped at the time limit."
    return Table("scaling", caption, table, columns)


def _figure(results: Results, cells: pd.DataFrame) -> Figure:
    within = cells[cells["verdict"] == "within"]
    drawing = style.figure(7.0)
    panels: list[Axes] = list(drawing.subplots(2, 1, sharex=True))
    styles = styles_of(results, within)
    for axes, name in zip(panels, ("load_case_s", "working_mib"), strict=True):
        for method, look in styles.items():
            line = within[within["method"] == method].sort_values("n")
            axes.plot(line["n"], _fitted(line, name).where(lambda v: v > 0), **look)
        axes.set(xscale="log", yscale="log", ylabel=GROWING[name])
    data = within.groupby("n")[["cholesky_s", "m"]].median().dropna()
    limits = (
        (panels[0], data["cholesky_s"], "one Cholesky of Q"),
        (panels[1], 8 * data["m"] ** 2 / 2**20, "Q itself"),
    )
    for axes, limit, what in limits:
        axes.plot(limit.index, limit, color="#888888", linewidth=1.0, zorder=0.5)
        axes.annotate(
            what, (limit.index[-1], limit.iloc[-1]), (4, 0), textcoords="offset points", va="center",
            fontsize=7.5, color="#666666",
        )  # fmt: skip
        style.plain_log(axes.yaxis)
    ticks = sorted(cells["n"].unique())
    panels[1].set_xticks(ticks, [f"{n:.0f}" for n in ticks])
    panels[1].minorticks_off()
    panels[1].set_xlabel("n")
    drawing.legend(handles=style.legend_entries(styles), loc="outside right upper", handlelength=3.2)
    caption = (
        "*Time and working memory against the size*, for one joint and load on finer and finer grids, on "
        "logarithmic axes; answers within the limit only."
    )
    return Figure("scaling", caption, drawing)
