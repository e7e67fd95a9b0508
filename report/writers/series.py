"""Writes the report of a series: report.md, a PNG per figure, a CSV per figure and table,
and a page in HTML with the maps.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm

from report.analysis.remaining_gaps import QUANTILES, convergence, exceedance, quantile_maps
from report.document.blocks import Block, Column, Figure, Section, Table, Text, number
from report.document.escape import csv_frame, file_name
from report.document.numbers import counted, listed, significant, tidy_power
from report.figures import style
from report.figures.maps import draw
from report.page.series import series_data
from report.page.write import write as write_page
from report.results.series import Series, read

from .markdown import save_block
from .pages import rendered

MAPPED = (0.5, 0.95, 0.99)
LOOKS = ((style.BLUE, "-"), (style.VERMILLION, "--"), (style.BLACK, ":"))
RING: dict[str, Any] = {"markersize": 3.2, "markerfacecolor": "none", "markeredgecolor": style.VERMILLION}
STEPS = {"setup_s": "update or set-up", "solve_s": "solve", "form_s": "x, gaps, residuals, error bound"}


def write(directory: Path) -> Path:
    """Write DIRECTORY/report/report.md from the series in DIRECTORY, and index.html beside it.

    Returns the path of the former.
    """
    series = read(directory)
    target = directory / "report"
    target.mkdir(exist_ok=True)
    for stale in [*target.glob("*.png"), *target.glob("*.csv")]:
        stale.unlink()
    sections = [Section("Summary", [Text(_summary(series))])]
    with style.applied():
        if len(series.cases):
            sections.append(Section("The remaining gap", [*_pictures(series, target), _statistics(series)]))
        saved = [Section(s.title, [save_block(block, target) for block in s.blocks]) for s in sections]
    path = target / "report.md"
    title = f"Series on {series.facts['scene']}: {series.facts['cases']} load cases"
    path.write_text(rendered("sections.md.j2", title=title, sections=saved, csv=True), "utf-8")
    if len(series.cases):
        maps, names = quantile_maps(series), [*(f"{100 * q:g} % quantile" for q in QUANTILES), "mean"]
        write_page(target / "index.html", title, series_data(series, maps, names, exceedance(series)))
    return path


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
        proven = int(cases["bound_mm"].notna().sum())
        bound = significant(cases["bound_mm"].max()) if proven else None
        if proven == len(cases):
            lines.append(f"Every answer is proven to be within {bound} mm of the exact one.")
        else:
            others = f"; of {counted(proven, 'other')} it is at most {bound} mm" if proven else ""
            lines.append(
                f"The error of {counted(len(cases) - proven, 'answer')} could not be bounded{others}."
            )
        checked = cases["displacement_error_mm"].dropna()
        if len(checked):
            lines.append(
                f"Of {counted(len(checked), 'case')} compared with the certified reference the largest error "
                f"is {significant(checked.max())} mm."
            )
        seconds = sum(float(cases[name].sum()) for name in STEPS)
        known = {name: text for name, text in STEPS.items() if cases[name].notna().any()}
        steps = (f"{significant(1e3 * cases[name].mean())} ms {text}" for name, text in known.items())
        lines.append(
            f"{significant(len(cases) / seconds)} cases per second of work; on average {listed(list(steps))} "
            "per case."
        )
    return " ".join(lines)


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


def _pictures(series: Series, target: Path) -> list[Block]:
    maps = quantile_maps(series)
    nodes = series.nodes
    table = pd.DataFrame(maps.T, columns=[*(f"q{q:g}_mm" for q in QUANTILES), "mean_mm"])
    case = int(series.cases["case"].iloc[series.cases["max_gap_mm"].to_numpy().argmax()])
    gap = np.asarray(series.gaps[case], dtype=float)
    blocks: list[Block] = []
    if nodes is not None:
        table.insert(0, "x_mm", nodes[:, 0])
        table.insert(1, "y_mm", nodes[:, 1])
        shown = [(f"{100 * q:g} % quantile", maps[QUANTILES.index(q)]) for q in MAPPED]
        caption = (
            "*The remaining gap at each contact: quantiles over the cases.* In one case out of twenty, the "
            "gap at a contact exceeds its 95 % quantile. Each map has a square-root scale of its own."
        )
        blocks.append(_maps("quantile-maps", caption, series, shown))
        worst_caption = f"*The worst case, number {case}, with a largest gap of {significant(gap.max())} mm.*"
        blocks.append(_maps("worst-case", worst_caption, series, [(f"case {case}", gap)]))
        pd.DataFrame({"x_mm": nodes[:, 0], "y_mm": nodes[:, 1], "gap_mm": gap}).to_csv(
            target / "worst-case.csv", index=False
        )
    table.to_csv(target / "quantile-maps.csv", index=False)
    blocks.append(_exceedance(series, target))
    if series.swept:
        return blocks + [_swept(series, key, target) for key in series.swept]
    return [*blocks, _convergence(series, target)]


def _maps(name: str, caption: str, series: Series, shown: list[tuple[str, np.ndarray]]) -> Figure:
    """Each map on a square-root scale of its own, with its largest gap above it."""
    assert series.nodes is not None
    width, height = np.ptp(series.nodes, axis=0)
    strip = max(7.6 * height / (width or 1.0), 0.5)
    drawing = style.figure(len(shown) * (min(strip, 4.0) + 0.4) + 0.6)
    panels: list[Axes] = list(drawing.subplots(len(shown), 1, sharex=True, sharey=True, squeeze=False)[:, 0])
    for axes, (title, values) in zip(panels, shown, strict=True):
        low, high = min(0.0, float(values.min())), float(values.max())
        norm = PowerNorm(0.5, low, high if high > low else low + 1.0)
        mapped = draw(axes, series.nodes, values, norm, "viridis")
        drawing.colorbar(mapped, ax=axes, label="gap, mm", aspect=6, pad=0.015, fraction=0.05)
        axes.plot(*series.fasteners.T, "o", label="fasteners", **RING)
        axes.set_title(f"{title}: at most {significant(high)} mm")
    panels[-1].set_xlabel("x, mm")
    if len(series.fasteners):
        drawing.legend(*panels[0].get_legend_handles_labels(), loc="outside lower left")
    return Figure(name, caption, drawing)


def _exceedance(series: Series, target: Path) -> Figure:
    curve = exceedance(series)
    curve.to_csv(target / "exceedance.csv", index=False)
    drawing = style.figure(3.2)
    axes: Axes = drawing.subplots()
    names = (
        ("share_of_cases", "cases, by their\nlargest gap"),
        ("share_of_contacts", "contacts, mean\nof the cases"),
    )
    for (name, label), (colour, line) in zip(names, LOOKS, strict=False):
        shown = curve[curve[name] > 0]
        axes.plot(shown["gap_mm"], 100 * shown[name], line, color=colour, label=label)
    axes.set(yscale="log", xlabel="gap t, mm", ylabel="share with more than t, %", xlim=(0, None))
    style.plain_log(axes.yaxis)
    drawing.legend(loc="outside right upper")
    caption = (
        "*Exceedance: how often a remaining gap exceeds t.* The smallest share of cases that can be resolved "
        f"is {significant(100 / len(series.cases))} %."
    )
    return Figure("exceedance", caption, drawing)


def _convergence(series: Series, target: Path) -> Figure:
    table = convergence(series)
    table.to_csv(target / "convergence.csv", index=False)
    drawing = style.figure(3.2)
    axes: Axes = drawing.subplots()
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
    return Figure("convergence", caption, drawing)


def _swept(series: Series, key: str, target: Path) -> Figure:
    name = f"sweep-{file_name(key)}"
    found = series.cases.groupby(key)[["max_gap_mm", "mean_gap_mm"]].agg(["min", "median", "max"])
    found.columns = ["_".join(pair) for pair in found.columns.to_flat_index()]
    csv_frame(found.reset_index()).to_csv(target / f"{name}.csv", index=False)
    drawing = style.figure(3.2)
    axes: Axes = drawing.subplots()
    for figure, label, (colour, line) in zip(
        ("max_gap_mm", "mean_gap_mm"), ("largest", "mean"), LOOKS, strict=False
    ):
        axes.plot(
            found.index, found[f"{figure}_median"], line, color=colour, marker="o", markersize=3, label=label
        )
        axes.fill_between(
            found.index, found[f"{figure}_min"], found[f"{figure}_max"], color=colour, alpha=0.15, lw=0
        )
    axes.set(xlabel=key, ylabel="remaining gap, mm")
    drawing.legend(loc="outside right upper")
    caption = f"*The largest and the mean gap per case against {key}.* Shaded: the range over the other keys."
    return Figure(name, caption, drawing)
