"""Figures 5 to 7: working time against the active contacts, and where one method overtakes another."""

from __future__ import annotations

import math
from itertools import pairwise

import pandas as pd
from matplotlib.figure import Figure as Drawing

from report.analysis.standings import shown
from report.document.blocks import Block, Figure, Section
from report.figures import style
from report.figures.line_charts import MARKS, against_contacts, entries

from .rows import METHODS, Study, table
from .table3 import LOOKS

FIGURES = {4386: 5, 6112: 6, 11308: 7}
PAIRS = [(gi, ipm) for ipm in METHODS[:2] for gi in METHODS[2:]] + [("GI primal", "GI dual")]
THICK = {"linewidth": 2.2, "markersize": 5.5, "zorder": 3}
THIN = {"linewidth": 0.9, "markersize": 3.5}


def section(study: Study) -> Section | None:
    if not study.sizes:
        return None
    blocks: list[Block] = []
    for n in study.sizes:
        about = (
            f"*Working time against the active contacts, n = {n}*: Figure {FIGURES.get(n, '–')} of the "
            "paper. Seconds per load case, without data preparation; thick: the paper's methods. "
            f"{MARKS.format(limit='1e-7 mm')}"
        )
        rows = [row for row in study.rows if row["n"] == n and row["method"]]
        blocks.append(Figure(f"figure-{n}", about, _drawn(shown(pd.DataFrame(rows)))))
    about = (
        "*Where one method overtakes the other* as more contacts close: linear interpolation of the "
        "logarithm of the seconds in the active share. Beside a stopped run, only the interval is known."
    )
    lines = [
        {"n": n, "of": a, "and": b, "crossing, active in % of m": crossings(study, n, a, b)}
        for n in study.sizes
        for a, b in PAIRS
    ]
    return Section(
        "Figures 5 to 7: time against active contacts", [*blocks, table("crossings", about, lines)]
    )


def crossings(study: Study, n: int, first: str, second: str) -> str:
    """'at 2 % GI primal is faster; at 47 % GI dual becomes faster'.

    A time that is only a lower bound decides if it is the larger of the two.
    """
    a, b = study.of(first, n), study.of(second, n)
    points = []  # active share, log(seconds of second / seconds of first), both exact
    for scene in a:
        mine, other = a[scene], b.get(scene)
        if other and mine["at_least"] and other["at_least"] and mine["m"]:
            ratio = math.log(other["at_least"] / mine["at_least"])
            if not ((mine["cut"] and ratio >= 0) or (other["cut"] and ratio <= 0)):
                points.append((100 * mine["active"] / mine["m"], ratio, not (mine["cut"] or other["cut"])))
    if not points:
        return "not measured"
    lost = len(set(a) | set(b)) - len(points)
    words = [f"at {points[0][0]:.0f} % {first if points[0][1] > 0 else second} is faster"]
    for (x0, r0, exact0), (x1, r1, exact1) in pairwise(points):
        if (r0 > 0) != (r1 > 0):
            where = f"between {x0:.0f} and {x1:.0f} %"
            if exact0 and exact1:
                where = f"at {x0 + (x1 - x0) * r0 / (r0 - r1):.0f} %"
            words.append(f"{where} {first if r1 > 0 else second} becomes faster")
    if len(words) == 1:
        words = [f"none: {words[0].split(' % ')[1]} from {points[0][0]:.0f} to {points[-1][0]:.0f} %"]
    return "; ".join(words) + (f" ({lost} not comparable)" if lost else "")


def _drawn(cells: pd.DataFrame) -> Drawing:
    others = cells[~cells["method"].isin(METHODS)]
    looks = {name: look | THICK for name, look in LOOKS.items() if name in set(cells["method"])}
    looks |= {name: look | THIN for name, look in style.line_styles(others).items()}
    drawing, (axes,) = style.panels(1, 3.8, entries(cells, looks))
    against_contacts(axes, cells, looks)
    axes.set(xlabel="active contacts", ylabel="working time, s")
    return drawing
