"""Figures 5 to 7: working time against the active contacts, the crossings, and the worst cases."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ... import style
from ...blocks import Block, Column, Figure, Section, Table, number, word
from ...labels import in_order
from ...numbers import whole
from ...rows import Results
from .crossings import BETTER, below, compared, sizes, worst
from .looks import LOOKS
from .selection import METHODS, cells_of_paper, is_paper, method, of_problems, records, seconds_text, timed

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


def libraries(cells: pd.DataFrame) -> pd.DataFrame:
    """The cells of the other solvers."""
    return cells[~cells["solver"].isin(["ipm", "gi"])]


def _figure(cells: pd.DataFrame, n: int) -> Figure:
    cells = timed(cells[cells["n"] == n])
    others = libraries(cells)
    styles = style.line_styles(others) if len(others) else {}
    drawing = style.figure(4.2)
    axes = drawing.add_subplot()
    handles = []
    lines = [(name, method(cells, name), LOOKS[name] | THICK) for name in METHODS]
    thin = {"linewidth": 0.9, "markersize": 4.0, "zorder": 1.8}
    lines += [(s, others[others["series"] == s], styles[s] | thin) for s in in_order(others, "series")]
    for name, rows, look in lines:
        if rows.empty:
            continue
        known = rows[rows["load_case_s"].notna()].sort_values("active")
        axes.plot(known["active"], known["load_case_s"], **look)
        _marks(axes, rows, look["color"])
        handles.append(Line2D([], [], label=name, **look))
    axes.set(yscale="log", xlabel="active contacts", ylabel="working time, s")
    axes.margins(x=0.05, y=0.08)
    style.plain_log(axes.yaxis)
    m = float(cells["m"].iloc[0])
    to_percent = (partial(np.multiply, 100 / m), partial(np.multiply, m / 100))
    percent = axes.secondary_xaxis("top", functions=to_percent)
    percent.xaxis.set_major_formatter(lambda value, _: f"{value:g} %")
    drawing.legend(handles=[*handles, *_legend(cells)], loc="outside right upper", handlelength=3.2)
    caption = (
        f"*Working time against the active contacts, n = {n}*"
        + (f" (Figure {FIGURE[n]} of the paper)" if n in FIGURE else "")
        + ": seconds a load case, without data preparation; below in number, above in % of m. Thick: "
        "the paper's methods; thin: the other solvers. Crossed out: answered, but not within the limit. "
        "Open triangles stand at the time limit of runs that did not finish; crosses at the upper edge, runs "
        "without an answer for another reason."
    )
    return Figure(f"paper-figure-{n}", caption, drawing)


def _marks(axes: Axes, rows: pd.DataFrame, color: str) -> None:
    outside = rows[rows["load_case_s"].notna() & (rows["verdict"] != "within")]
    axes.plot(outside["active"], outside["load_case_s"], "x", color="black", markersize=6.5, zorder=3)
    late = rows[rows["cut"] & rows["load_case_s"].isna()]
    hollow: dict[str, Any] = {"color": color, "markerfacecolor": "none", "linestyle": "", "zorder": 4}
    axes.plot(late["active"], late["at_least"], marker="^", markersize=7, **hollow)
    lost = rows[rows["load_case_s"].isna() & ~rows["cut"]]
    edge = axes.get_xaxis_transform()
    axes.plot(lost["active"], [0.98] * len(lost), marker="x", markersize=6, transform=edge, **hollow)


def _legend(cells: pd.DataFrame) -> list[Line2D]:
    """Entries for those of the marks that occur."""
    drawn = pd.concat([libraries(cells), *(method(cells, name) for name in METHODS)])
    answered = drawn["load_case_s"].notna()
    marks = [
        (answered & (drawn["verdict"] != "within"), "not within the limit", "x", "black"),
        (~answered & drawn["cut"], "not finished in time", "^", style.GREY),
        (~answered & ~drawn["cut"], "no answer", "x", style.GREY),
    ]
    look: dict[str, Any] = {"linestyle": "", "markerfacecolor": "none"}
    return [Line2D([], [], label=t, marker=k, color=c, **look) for present, t, k, c in marks if present.any()]


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
        "*Where one method overtakes the other* as more contacts close: the logarithm of the seconds a load "
        "case, linear in the active share between two scenes. Where one of the two runs was stopped by the "
        "clock only the interval is known."
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
        "the scenes of a size; the better of the two forms is chosen for each scene. >: stopped by the clock."
    )
    return Table("paper-worst", caption, pd.DataFrame(lines), columns)


def _text(name: str) -> Callable[[Mapping[str, Any]], str]:
    return lambda row: str(row[name])


def _times(cells: pd.DataFrame, n: int) -> Table:
    """A line a scene, a column a method: the figure in numbers."""
    cells = cells[cells["n"] == n]
    lines: dict[str, dict[str, Any]] = {}
    others = libraries(cells)
    named = [(name, method(cells, name)) for name in METHODS]
    named += [(s, others[others["series"] == s]) for s in in_order(others, "series")]
    for name, rows in named:
        for row in records(rows):
            start = {"scene": row["scene"], "active": row["active"], "m": row["m"]}
            lines.setdefault(row["scene"], start)[name] = seconds_text(row)
    names = [name for name, rows in named if len(rows)]
    table = pd.DataFrame(list(lines.values())).sort_values("active")
    table[names] = table[names].fillna("")
    columns = [word("scene", "scene"), Column("active", _active)]
    columns += [Column(name, _text(name)) for name in names]
    caption = f"*The figure for n = {n} in numbers*: seconds a load case; > : stopped by the time limit."
    return Table(f"paper-times-{n}", caption, table, columns)


def _active(row: Mapping[str, Any]) -> str:
    return f"{row['active']:.0f} ({100 * row['active'] / row['m']:.0f} %)"
