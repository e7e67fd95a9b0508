"""Writes the report of a series: report.md, PNG and CSV, a page in HTML with maps, and a sheet to file."""

from pathlib import Path

import numpy as np
import pandas as pd

from report.analysis.checks import code_warnings
from report.document.blocks import Figure, Section, Table, Text, facts_table, number, word
from report.document.escape import file_name
from report.document.numbers import beside, counted, out_of, raised, significant, tidy_power
from report.figures import style
from report.figures.junction_maps import Map, larger_than, map_sheet, rooted
from report.page.contact_maps import map_view, series_maps
from report.page.page_figures import exceedance_figure, item
from report.page.page_file import Data, banner
from report.page.page_file import write as write_page
from report.results.series_results import (
    QUANTILES,
    Array,
    Series,
    allowed_mm,
    convergence,
    exceedance,
    quantile_maps,
    read,
)
from report.writers.sections_writer import emptied, written
from report.writers.series_contributors import contributors_of
from report.writers.sheet import MESH, Sheet, exactness, origin, write_sheet

MAPPED = (0.5, 0.95, 0.99)
PERCENT = {q: f"{100 * q:g} % quantile" for q in QUANTILES}
LOOKS = ((style.BLUE, "-"), (style.VERMILLION, "--"), (style.BLACK, ":"))
GAPS = {"max_gap_mm": "largest gap per case", "mean_gap_mm": "mean gap per case"}
STEPS = {"setup_s": "update or set-up", "solve_s": "solve", "form_s": "x, gaps, residuals, error bound"}
WHERE = "At each contact: [allowed-gap.csv](../allowed-gap.csv)."
CURVES = {"share_of_cases": "cases, by their largest gap", "share_of_contacts": "contacts, mean of the cases"}


def write(directory: Path) -> Path:
    """Write report/report.md of the series in DIRECTORY, with a page and a sheet; returns its path."""
    series = read(directory)
    check = series.facts.get("allowed_gap")
    verdict = [Text(f"**{check['said'][-1]}** {' '.join(check['said'][:-1])} {WHERE}")] if check else []
    sections = [Section("Summary", [*verdict, _summary(series)])]
    title = f"Series on {series.facts['scene']}: {counted(series.facts['cases'], 'load case')}"
    data: Data = {}
    if len(series.cases):
        maps, curve = quantile_maps(series), exceedance(series)
        with style.applied():
            spread = [_swept(series, key) for key in series.swept] or [_convergence(series)]
            figures = [*_maps(series, maps), _exceedance(curve, len(series.cases)), *spread]
            blocks = [*figures, *contributors_of(series), _statistics(series)]
        sections.append(Section("The remaining gap", blocks))
        data = series_data(series, maps, curve)
    target = emptied(directory / "report")
    page = written(target / "report.md", title, sections)
    if data:
        write_page(target / "index.html", title, data)
        write_sheet(target / "sheet.pdf", _sheet(series, directory, target))
    return page


def _sheet(series: Series, directory: Path, target: Path) -> Sheet:
    facts, check = series.facts, series.facts.get("allowed_gap") or {"kind": "", "said": []}
    *sure, verdict = check["said"] or [f"The largest gap left is {_largest(series)}."]
    sure = [exactness(series.cases["gap_error_mm"].max(skipna=False)), *sure, MESH]
    allowed = [directory / "allowed-gap.png"] if check["said"] else []
    pictures = [*allowed, target / "worst-case.png", target / "quantile-maps.png"]
    record = facts | {
        "commit": series.code["commit"].iloc[-1],
        "scene_key": facts["identity"].get("scene_key"),
        "version": (facts.get("versions") or {}).get("rivetbench", ""),
    }
    about = origin(record), facts.get("inputs", {}), [file for file in pictures if file.exists()][:2]
    return Sheet(str(facts["title"]), check["kind"], verdict, sure, *about, [_statistics(series)])


def _largest(series: Series) -> str:
    largest = beside(allowed_mm(series.facts))(series.cases["max_gap_mm"].max())
    return f"{largest} mm, in case {series.worst_case}"


def _summary(series: Series) -> Table:
    facts, cases, identity = series.facts, series.cases, series.facts["identity"]
    verdicts = ", ".join(f"{count} {verdict.replace('_', ' ')}" for verdict, count in series.counts.items())
    summary = {
        "scene": facts["title"],
        "solved": f"{out_of(sum(series.counts.values()), facts['cases'], 'case')}: {verdicts}",
        "solver": f"{identity['solver']} ({identity['form']}), tolerance {tidy_power(identity['tolerance'])}",
        "machine": f"{facts['machine']}, {counted(facts['threads'], 'thread')}",
    }
    if len(cases):
        bounds, checked = cases["bound_mm"].dropna(), cases["displacement_error_mm"].dropna()
        largest, seconds = cases["max_gap_mm"], cases[list(STEPS)]
        rate = significant(len(cases) / float(seconds.sum().sum()))
        compared, bound = counted(len(checked), "case"), significant(raised(bounds.max()))
        summary |= {
            "largest gap left": _largest(series),
            "median of the largest gaps": f"{significant(largest.median())} mm",
            "proven error bound": f"{bound} mm, {len(cases) - len(bounds)} unproven",
            "error beside the reference": f"{significant(checked.max())} mm, {compared} compared",
            "speed": f"{rate} cases per second of work",
        }
        for name, text in STEPS.items():
            if seconds[name].notna().any():
                summary[f"ms per case: {text}"] = significant(1e3 * seconds[name].mean())
    return facts_table("summary", "*The series.*", summary)


def _statistics(series: Series) -> Table:
    figures = series.cases[list(GAPS)]
    table = figures.quantile(QUANTILES).T.rename(columns="q{:g}".format)
    table = table.assign(figure=list(GAPS.values()), mean=figures.mean(), largest=figures.max())
    columns = [word("mm", "figure"), number("mean", "mean")]
    columns += [number(f"{100 * q:g} %", f"q{q:g}") for q in QUANTILES]
    columns.append(number("largest", "largest", beside(allowed_mm(series.facts))))
    return Table("statistics", "*Quantiles over the cases.*", table, columns)


def _maps(series: Series, maps: Array) -> list[Figure]:
    """Maps of some quantiles on one scale, and of the case with the largest gap."""
    nodes = series.nodes
    if nodes is None:
        return []
    case = series.worst_case
    gap = np.asarray(series.gaps[case], dtype=float)
    places = pd.DataFrame(nodes[:, :2], columns=["x_mm", "y_mm"])
    values = dict(zip([*(f"q{q:g}_mm" for q in QUANTILES), "mean_mm"], maps, strict=True))
    scale = rooted("gap, mm", "viridis", *(values[f"q{q:g}_mm"] for q in MAPPED))
    quantiles = [Map(PERCENT[q], nodes, values[f"q{q:g}_mm"], scale, (), series.marks) for q in MAPPED]
    larger = larger_than(allowed_mm(series.facts), gap)
    worst = Map(f"case {case}", nodes, gap, rooted("gap, mm", "viridis", gap), [larger], series.marks)
    caption = "*The remaining gap at each contact: quantiles over the cases.*"
    of_worst = f"*The worst case: a largest gap of {_largest(series)}.*"
    return [
        Figure("quantile-maps", caption, map_sheet(quantiles, 3)[0], places.assign(**values)),
        Figure("worst-case", of_worst, map_sheet([worst], 1)[0], places.assign(gap_mm=gap)),
    ]


def _exceedance(curve: pd.DataFrame, cases: int) -> Figure:
    drawing, axes = style.single(3.2)
    for (name, label), (colour, line) in zip(CURVES.items(), LOOKS, strict=False):
        shown = curve[curve[name] > 0]
        axes.plot(shown["gap_mm"], 100 * shown[name], line, color=colour, label=label)
    axes.set(yscale="log", xlabel="gap t, mm", ylabel="share with more than t, %", xlim=(0, None))
    style.plain_log(axes.yaxis)
    drawing.legend(loc="outside upper center", ncols=2)
    caption = f"*Exceedance: how often a gap exceeds t*, down to {significant(100 / cases)} % of the cases."
    return Figure("exceedance", caption, drawing, curve)


def _convergence(series: Series) -> Figure:
    table = convergence(series)
    drawing, axes = style.single(3.2)
    for q, (colour, line) in zip(QUANTILES[1:], LOOKS, strict=True):
        lines = table[table["quantile"] == q]
        axes.plot(lines["cases"], lines["gap_mm"], line, marker=".", color=colour, label=PERCENT[q])
        axes.fill_between(lines["cases"], lines["low_mm"], lines["high_mm"], color=colour, alpha=0.15, lw=0)
    axes.set(xscale="log", xlabel="number of cases", ylabel="largest gap per case, mm")
    style.plain_log(axes.xaxis)
    drawing.legend(loc="outside right upper")
    caption = (
        "*Are there enough cases? Quantiles of the largest gap per case over the first N cases*, shaded: "
        "their distribution-free 95 % interval, where N suffices for one."
    )
    return Figure("convergence", caption, drawing, table)


def _swept(series: Series, key: str) -> Figure:
    ranges = series.cases.groupby(key)[list(GAPS)].agg(["min", "median", "max"])
    ranges.columns = ["_".join(pair) for pair in ranges.columns.to_flat_index()]
    drawing, axes = style.single(3.2)
    for (name, label), (colour, line) in zip(GAPS.items(), LOOKS, strict=False):
        middle, low, high = (ranges[f"{name}_{end}"] for end in ("median", "min", "max"))
        axes.plot(ranges.index, middle, line, color=colour, marker="o", markersize=3, label=label)
        axes.fill_between(ranges.index, low, high, color=colour, alpha=0.15, lw=0)
    axes.set(xlabel=key, ylabel="remaining gap, mm")
    drawing.legend(loc="outside right upper")
    caption = f"*The largest and the mean gap per case against {key}*, shaded: the range over the other keys."
    error = 2 * series.cases["gap_error_mm"].astype(float).max(skipna=False)  # NaN if one is unknown
    others = [name for name in series.swept if name != key]
    alike = series.cases.groupby(others or np.zeros(len(series.cases)))[list(GAPS)]
    if len(ranges) > 1 and (alike.max() - alike.min()).to_numpy().max() <= error:
        caption += (
            f" **{key} changes neither**, to what is proven: closed contacts carry the difference, or it "
            "acts where no gap is left."
        )
    return Figure(f"sweep-{file_name(key)}", caption, drawing, ranges.reset_index())


def series_data(series: Series, quantiles: Array, curve: pd.DataFrame) -> Data:
    """The data of the page. quantiles, curve : of `quantile_maps` and `exceedance` of series_results."""
    facts = series.facts
    versions = facts.get("versions") or {}
    identity = facts["identity"]
    gaps = curve["gap_mm"].to_numpy()
    curves = {text: (gaps, 100 * curve[key].to_numpy()) for key, text in CURVES.items()}
    rows = series.code.assign(
        machine=str(facts["machine"]),
        recorded_at="",
        solver=identity["solver"],
        solver_code=identity.get("solver_code") or "",
    )
    check = facts.get("allowed_gap")
    page = map_view(series_maps(series, quantiles, [*PERCENT.values(), "mean"]))
    page["figures"]["curves"] = item(exceedance_figure(curves), "curves")
    return page | {
        "headline": {"kind": check["kind"], "text": " ".join(check["said"][::-1])} if check else None,
        "banner": banner(
            rows,
            warnings=code_warnings(rows),
            counts=f"{out_of(len(series.cases), facts['cases'], 'load case')} answered",
            versions=[f"{name} {version}" for name, version in versions.items()],
        ),
    }
