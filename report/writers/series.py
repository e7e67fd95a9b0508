"""Writes the report of a series: report.md, PNG and CSV, and a page in HTML with the maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from report.analysis.remaining_gaps import QUANTILES, convergence, exceedance, quantile_maps
from report.document.blocks import Block, Column, Figure, Section, Table, Text, number
from report.document.escape import file_name
from report.document.numbers import counted, listed, significant, tidy_power
from report.figures import style
from report.figures.maps import Map, drawn, rooted
from report.page.series import series_data
from report.page.write import write as write_page
from report.results.series import Series, read

from .pages import emptied, written

MAPPED = (0.5, 0.95, 0.99)
LOOKS = ((style.BLUE, "-"), (style.VERMILLION, "--"), (style.BLACK, ":"))
STEPS = {"setup_s": "update or set-up", "solve_s": "solve", "form_s": "x, gaps, residuals, error bound"}


def write(directory: Path) -> Path:
    """Write DIRECTORY/report/report.md from the series in DIRECTORY, and index.html beside it.

    Returns the path of the former.
    """
    series = read(directory)
    target = emptied(directory / "report")
    sections = [Section("Summary", [Text(_summary(series))])]
    title = f"Series on {series.facts['scene']}: {series.facts['cases']} load cases"
    if len(series.cases):
        maps, curve = quantile_maps(series), exceedance(series)
        with style.applied():
            blocks = [*_maps(series, maps), _exceedance(curve, len(series.cases)), *_spread(series)]
        sections.append(Section("The remaining gap", [*blocks, _statistics(series)]))
        names = [*(f"{100 * q:g} % quantile" for q in QUANTILES), "mean"]
        write_page(target / "index.html", title, series_data(series, maps, names, curve))
    return written(target / "report.md", title, sections)


def _summary(series: Series) -> str:
    facts, cases, identity = series.facts, series.cases, series.facts["identity"]
    counts = ", ".join(f"{count} {verdict.replace('_', ' ')}" for verdict, count in series.counts.items())
    lines = [
        f"{facts['title']}. {sum(series.counts.values())} of {facts['cases']} cases solved with "
        f"`{identity['solver']}` ({identity['form']} form, tolerance {tidy_power(identity['tolerance'])}, "
        f"{counted(facts['threads'], 'thread')}) on {facts['machine']}: {counts}."
    ]
    if len(cases):
        worst = int(cases["max_gap_mm"].to_numpy().argmax())
        lines.insert(
            0,
            f"**The largest gap left in any case is {significant(cases['max_gap_mm'].iloc[worst])} mm, in "
            f"case {cases['case'].iloc[worst]}; in half of the cases the largest is at most "
            f"{significant(cases['max_gap_mm'].median())} mm.**",
        )
        lines.append(_proven(cases["bound_mm"]))
        checked = cases["displacement_error_mm"].dropna()
        if len(checked):
            lines.append(
                f"Of {counted(len(checked), 'case')} compared with the certified reference the largest error "
                f"is {significant(checked.max())} mm."
            )
        seconds = sum(float(cases[name].sum()) for name in STEPS)
        known = {name: text for name, text in STEPS.items() if cases[name].notna().any()}
        steps = [f"{significant(1e3 * cases[name].mean())} ms {text}" for name, text in known.items()]
        lines.append(
            f"{significant(len(cases) / seconds)} cases per second of work; on average {listed(steps)} per "
            f"case."
        )
    return " ".join(lines)


def _proven(bounds: pd.Series[float]) -> str:
    proven, missing, most = int(bounds.notna().sum()), int(bounds.isna().sum()), significant(bounds.max())
    if not missing:
        return f"Every answer is proven to be within {most} mm of the exact one."
    others = f"; of {counted(proven, 'other')} it is at most {most} mm" if proven else ""
    return f"The error of {counted(missing, 'answer')} could not be bounded{others}."


def _statistics(series: Series) -> Table:
    names = {"max_gap_mm": "largest gap per case", "mean_gap_mm": "mean gap per case"}
    rows = [
        {"figure": text, **{f"q{q:g}": series.cases[name].quantile(q) for q in QUANTILES}}
        | {"mean": series.cases[name].mean(), "largest": series.cases[name].max()}
        for name, text in names.items()
    ]
    columns = [Column("mm", lambda row: str(row["figure"]), "left"), number("mean", "mean")]
    columns += [number(f"{100 * q:g} %", f"q{q:g}") for q in QUANTILES] + [number("largest", "largest")]
    return Table("statistics", "*Quantiles over the cases.*", pd.DataFrame(rows), columns)


def _maps(series: Series, maps: np.ndarray) -> list[Block]:
    """Of some quantiles on one scale, and of the case with the largest gap."""
    nodes = series.nodes
    if nodes is None:
        return []
    case = int(series.cases["case"].iloc[series.cases["max_gap_mm"].to_numpy().argmax()])
    gap = np.asarray(series.gaps[case], dtype=float)
    places = pd.DataFrame({"x_mm": nodes[:, 0], "y_mm": nodes[:, 1]})
    names = [*(f"q{q:g}_mm" for q in QUANTILES), "mean_mm"]
    marks = {"fasteners": series.fasteners.tolist()} if len(series.fasteners) else {}
    shown = [maps[QUANTILES.index(q)] for q in MAPPED]
    scale = rooted("gap, mm", "viridis", *shown)
    quantiles = [
        Map(
            f"{100 * q:g} % quantile: at most {significant(values.max())} mm", nodes, values, scale, (), marks
        )
        for q, values in zip(MAPPED, shown, strict=True)
    ]
    worst = Map(f"case {case}", nodes, gap, rooted("gap, mm", "viridis", gap), (), marks)
    caption = "*The remaining gap at each contact: quantiles over the cases.*"
    of_worst = f"*The worst case, number {case}, with a largest gap of {significant(gap.max())} mm.*"
    return [
        Figure(
            "quantile-maps",
            caption,
            drawn(quantiles, 3)[0],
            places.assign(**dict(zip(names, maps, strict=True))),
        ),
        Figure("worst-case", of_worst, drawn([worst], 1)[0], places.assign(gap_mm=gap)),
    ]


def _exceedance(curve: pd.DataFrame, cases: int) -> Figure:
    drawing, axes = _axes()
    names = {
        "share_of_cases": "cases, by their\nlargest gap",
        "share_of_contacts": "contacts, mean\nof the cases",
    }
    for (name, label), (colour, line) in zip(names.items(), LOOKS, strict=False):
        shown = curve[curve[name] > 0]
        axes.plot(shown["gap_mm"], 100 * shown[name], line, color=colour, label=label)
    axes.set(yscale="log", xlabel="gap t, mm", ylabel="share with more than t, %", xlim=(0, None))
    style.plain_log(axes.yaxis)
    drawing.legend(loc="outside right upper")
    caption = (
        "*Exceedance: how often a remaining gap exceeds t.* The smallest share of cases that can be resolved "
        f"is {significant(100 / cases)} %."
    )
    return Figure("exceedance", caption, drawing, curve)


def _spread(series: Series) -> list[Block]:
    """Against each swept key, or, of random cases, the convergence of the quantiles."""
    return [_swept(series, key) for key in series.swept] or [_convergence(series)]


def _convergence(series: Series) -> Figure:
    table = convergence(series)
    drawing, axes = _axes()
    for q, (colour, line) in zip(QUANTILES[1:], LOOKS, strict=True):
        lines = table[table["quantile"] == q]
        axes.plot(lines["cases"], lines["gap_mm"], line, color=colour, label=f"{100 * q:g} % quantile")
        axes.fill_between(lines["cases"], lines["low_mm"], lines["high_mm"], color=colour, alpha=0.15, lw=0)
    axes.set(xscale="log", xlabel="number of cases", ylabel="largest gap per case, mm")
    style.plain_log(axes.xaxis)
    drawing.legend(loc="outside right upper")
    caption = (
        "*Are there enough cases? Quantiles of the largest gap per case over the first N cases.* Shaded: the "
        "distribution-free 95 % interval between order statistics, if N is large enough for one."
    )
    return Figure("convergence", caption, drawing, table)


def _swept(series: Series, key: str) -> Figure:
    found = series.cases.groupby(key)[["max_gap_mm", "mean_gap_mm"]].agg(["min", "median", "max"])
    found.columns = ["_".join(pair) for pair in found.columns.to_flat_index()]
    drawing, axes = _axes()
    for (name, label), (colour, line) in zip(
        {"max_gap_mm": "largest", "mean_gap_mm": "mean"}.items(), LOOKS, strict=False
    ):
        middle, low, high = (found[f"{name}_{end}"] for end in ("median", "min", "max"))
        axes.plot(found.index, middle, line, color=colour, marker="o", markersize=3, label=label)
        axes.fill_between(found.index, low, high, color=colour, alpha=0.15, lw=0)
    axes.set(xlabel=key, ylabel="remaining gap, mm")
    drawing.legend(loc="outside right upper")
    caption = f"*The largest and the mean gap per case against {key}.* Shaded: the range over the other keys."
    return Figure(f"sweep-{file_name(key)}", caption, drawing, found.reset_index())


def _axes() -> tuple[Drawing, Axes]:
    drawing = style.figure(3.2)
    return drawing, drawing.subplots()
