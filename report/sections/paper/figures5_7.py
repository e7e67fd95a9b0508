"""Figures 5 to 7: working time against the active contacts, the crossings, and the worst cases."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd

from report.analysis.paper.crossings import BETTER, below, compared, sizes, worst
from report.analysis.paper.selection import METHODS, cells_of_paper, is_paper, of_method, of_problems
from report.analysis.seconds import seconds_text
from report.document.blocks import Block, Column, Figure, Place, Section, Table, number, records, word
from report.document.numbers import whole
from report.figures import style, times_panel
from report.figures.paper_methods import LOOKS
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(270)

FIGURE = {4386: "5", 6112: "6", 11308: "7"}
PAIRS = (
    ("GI dual", "IPM"),
    ("GI primal", "IPM"),
    ("GI primal", "GI dual"),
    ("GI dual", "IPM, open gaps last"),
    ("GI primal", "IPM, open gaps last"),
)
RIVALS = ("GI primal", "GI dual", BETTER)
THICK = {"linewidth": 2.4, "markersize": 7.5, "markeredgewidth": 1.4}
THIN = {"linewidth": 0.9, "markersize": 4.0, "zorder": 1.8}
ANSWERS = {True: "yes", False: "no", None: "not decided"}


def section(results: Results) -> Section | None:
    if not is_paper(results):
        return None
    cells = of_problems(cells_of_paper(results))
    shown = sizes(cells)
    if not shown:
        return None
    blocks: list[Block] = [_figure(cells, n) for n in shown]
    blocks += [_crossings(cells, shown), _worst(cells, shown), *(_times(cells, n) for n in shown)]
    return Section("Figures 5 to 7: time against active contacts", blocks)


def _lines(cells: pd.DataFrame) -> pd.DataFrame:
    """The cells of the paper's methods, with their name as `method`, and those of the other solvers."""
    named = [of_method(cells, name).assign(method=name) for name in METHODS]
    return pd.concat([*named, cells[~cells["solver"].isin({solver for solver, *_ in METHODS.values()})]])


def _figure(cells: pd.DataFrame, n: int) -> Figure:
    lines = _lines(cells[cells["n"] == n])
    others = style.line_styles(lines[~lines["method"].isin(METHODS)])
    looks = {name: look | THICK for name, look in LOOKS.items()}
    looks |= {method: look | THIN for method, look in others.items()}
    styles = {method: looks[method] for method in _order(lines)}
    drawing = style.figure(4.2)
    axes = drawing.add_subplot()
    times_panel.panel(axes, lines, styles)
    axes.set(xlabel="active contacts", ylabel="working time, s")
    handles = [*style.legend_entries(styles), *times_panel.entries(lines)]
    drawing.legend(handles=handles, loc="outside right upper", handlelength=3.2)
    caption = (
        f"*Working time against the active contacts, n = {n}*"
        + (f" (Figure {FIGURE[n]} of the paper)" if n in FIGURE else "")
        + ": seconds per load case, without data preparation; the number below, the percentage of m above. "
        "Thick: the paper's methods; thin: the other solvers. " + times_panel.MARKS.format(limit="the limit")
    )
    return Figure(f"paper-figure-{n}", caption, drawing)


def _order(lines: pd.DataFrame) -> list[str]:
    """The methods that occur, the paper's first."""
    found = in_order(lines, "method")
    return [name for name in METHODS if name in found] + [name for name in found if name not in METHODS]


def _crossings(cells: pd.DataFrame, shown: list[int]) -> Table:
    lines = []
    for n in shown:
        for first, second in PAIRS:
            pair = compared(cells, n, first, second)
            at = ", ".join(f"{100 * c.at:.1f}" if c.at is not None else "?" for c in pair.crossings)
            line: dict[str, Any] = {"n": n, "first": first, "second": second, "crossings_percent": at}
            lines.append(line | {"text": str(pair), "scenes": len(pair.shares)})
    columns = [
        number("n", "n", whole),
        word("of", "first"),
        word("and", "second"),
        word("crossing, active in % of m", "text"),
        number("scenes compared", "scenes", whole),
    ]
    caption = (
        "*Where one method overtakes the other* as more contacts close: linear interpolation of the "
        "logarithm of the seconds per load case in the active share between two scenes. If one of the two "
        "runs was stopped by the clock, only the interval is known."
    )
    return Table("paper-crossings", caption, pd.DataFrame(lines), columns)


def _worst(cells: pd.DataFrame, shown: list[int]) -> Table:
    lines = []
    for n in shown:
        for name in ("IPM", "IPM, open gaps last"):
            mine = worst(cells, n, name)
            line: dict[str, Any] = {"n": n, "method": name, "worst": str(mine) if mine else "not measured"}
            line |= {"worst_s": mine.seconds if mine else None}
            for rival in RIVALS:
                other = worst(cells, n, rival)
                line[f"{rival}, s"] = other.seconds if other else None
                shown_as = ANSWERS[below(mine, other)]
                line[rival] = f"{shown_as} ({other})" if other else "not measured"
            lines.append(line)
    columns = [number("n", "n", whole), word("method", "method"), word("its worst case", "worst")]
    columns += [Column(f"below that of {rival}?", _text(rival), "left") for rival in RIVALS]
    caption = (
        "*Is the interior-point method's worst case below Goldfarb–Idnani's?* The longest working time over "
        "the scenes of a size; the better of the two forms is chosen on each scene. >: stopped by the clock."
    )
    return Table("paper-worst", caption, pd.DataFrame(lines), columns)


def _text(name: str) -> Callable[[Mapping[str, Any]], str]:
    return lambda row: str(row[name])


def _times(cells: pd.DataFrame, n: int) -> Table:
    """One line per scene, one column per method: the figure in numbers."""
    found = _lines(cells[cells["n"] == n])
    lines: dict[str, dict[str, Any]] = {}
    for row in records(found):
        start = {"scene": row["scene"], "active": row["active"], "m": row["m"]}
        lines.setdefault(row["scene"], start)[row["method"]] = seconds_text(row)
    names = _order(found)
    table = pd.DataFrame(list(lines.values())).sort_values("active")
    table[names] = table[names].fillna("")
    columns = [word("scene", "scene"), Column("active", _active)]
    columns += [Column(name, _text(name)) for name in names]
    caption = f"*The figure for n = {n} in numbers*: seconds per load case; >: stopped at the time limit."
    return Table(f"paper-times-{n}", caption, table, columns)


def _active(row: Mapping[str, Any]) -> str:
    return f"{row['active']:.0f} ({100 * row['active'] / row['m']:.0f} %)"
