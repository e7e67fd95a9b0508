"""Table 3: complexity and memory, measured at several sizes of one joint."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from report.analysis.paper.growth import QUANTITIES, fitted, measured
from report.analysis.paper.selection import METHODS, is_paper
from report.analysis.seconds import seconds_text
from report.document.blocks import Block, Column, Figure, Place, Section, Table, number, records, word
from report.document.numbers import MISSING, whole
from report.figures import style
from report.figures.paper_methods import LOOKS
from report.results.reader import Results

PLACE = Place(240)

PANELS = (
    ("preparation_s", "data preparation, s"),
    ("working_s", "working time, s"),
    ("s_per_step", "s per CG iteration or pivot"),
    ("working_mib", "working memory, MiB"),
)


def section(results: Results) -> Section | None:
    if not is_paper(results):
        return None
    lines = measured(results)
    if lines.empty or lines["n"].nunique() < 2:
        return None
    blocks: list[Block] = [_exponents(lines), _absolute(lines), _figure(lines)]
    return Section("Table 3: complexity and memory", blocks)


def _exponents(lines: pd.DataFrame) -> Table:
    records = []
    for quantity in QUANTITIES:
        record: dict[str, Any] = {"quantity": quantity.name.removesuffix(", s").removesuffix(", MiB")}
        record["theory"] = _theory(quantity.ipm, quantity.gi)
        for name in METHODS:
            fit = fitted(lines, name, quantity.key)
            record[name] = fit.slope if fit else None
            record[f"{name}, standard error"] = fit.error if fit else None
            record[f"{name}, sizes"] = fit.points if fit else 0
            record[f"{name}, shown"] = str(fit) if fit else MISSING
        records.append(record)
    columns = [word("quantity", "quantity"), word("order in n, paper", "theory")]
    columns += [Column(name, _shown(name)) for name in METHODS]
    sizes = ", ".join(f"{n:.0f}" for n in sorted(lines["n"].unique()))
    caption = (
        "*Measured exponents in n*, with the standard error of the fit: least squares in log–log over the "
        f"scenes of one joint at n = {sizes}. Data preparation: the Cholesky factor of K, Q, and the "
        "solver's own preparation (the inverse or factor of Q). Working time: seconds per load case. The "
        "paper's order for the interior-point method is n^2.5 times the CG iterations per system: √m outer "
        "iterations of n² per CG iteration; for Goldfarb–Idnani it is n_act·n², that is n³ at a constant "
        "share of active contacts. Runs without an answer within the limit, named in the table below, and "
        "times below a millisecond do not enter the fits."
    )
    return Table("paper-table3", caption, pd.DataFrame(records), columns)


def _theory(ipm: float | None, gi: float | None) -> str:
    if ipm == gi:
        return MISSING if ipm is None else f"{ipm:g}"
    words = [f"{name} {value:g}" for name, value in (("IPM", ipm), ("GI", gi)) if value is not None]
    return ", ".join(words)


def _shown(name: str) -> Callable[[Mapping[str, Any]], str]:
    return lambda row: row[f"{name}, shown"]


def _absolute(lines: pd.DataFrame) -> Table:
    table = lines.sort_values(["n", "method"], key=lambda c: c.map(_place) if c.name == "method" else c)
    table = table.assign(
        full_mib=8 * table["n"] ** 2 / 2**20, seconds=[seconds_text(r) for r in records(table)]
    )
    columns = [
        number("n", "n", whole),
        Column("active", lambda row: _active(row)),
        word("method", "method"),
        number("data preparation, s", "preparation_s"),
        number("of it prepare", "prepare_s"),
        word("working time, s", "seconds"),
        number("outer iterations", "iterations", whole),
        number("CG", "cg", whole),
        number("pivots", "pivots", whole),
        number("working memory, MiB", "working_mib", whole),
        number("peak, MiB", "peak_rss_mib", whole),
        number("an n × n matrix, MiB", "full_mib", whole),
    ]
    caption = (
        "*The data of the fits.* Working memory: the largest resident memory minus that resident when the "
        "solver's work began (interpreter and data). >: stopped at the time limit."
    )
    return Table("paper-scaling", caption, table, columns)


def _place(name: str) -> int:
    return list(METHODS).index(name)


def _active(row: Mapping[str, Any]) -> str:
    share = f" ({100 * row['active'] / row['m']:.0f} %)" if row["m"] > 0 else ""
    return whole(row["active"]) + share


def _figure(lines: pd.DataFrame) -> Figure:
    lines = lines.assign(s_per_step=lines["s_per_cg"].fillna(lines["s_per_pivot"]).astype(float))
    drawing = style.figure(5.6)
    panels: list[Axes] = list(drawing.subplots(2, 2, sharex=True).ravel())
    for axes, (key, title) in zip(panels, PANELS, strict=True):
        for name, look in LOOKS.items():
            of_method = lines[lines["method"] == name].dropna(subset=[key]).sort_values("n")
            axes.plot(of_method["n"], of_method[key].astype(float), label=name, **look)
        axes.set(xscale="log", yscale="log", ylabel=title)
        ticks = sorted(lines["n"].unique())
        axes.set_xticks(ticks, [f"{n:.0f}" for n in ticks], rotation=30)
        axes.minorticks_off()
    for axes in panels[2:]:
        axes.set_xlabel("n")
    drawing.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", handlelength=3.2)
    caption = (
        "*The same on logarithmic axes*, where a power of n is a straight line whose slope is the exponent "
        "of the table. Runs without an answer within the limit have no point."
    )
    return Figure("paper-table3", caption, drawing)
