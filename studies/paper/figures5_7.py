"""Figures 5 to 7: working time against the active contacts, and where one method overtakes another."""

from __future__ import annotations

import math
from itertools import pairwise

import pandas as pd
from matplotlib.figure import Figure

from report.figures import style

from .page import Page
from .rows import METHODS, Row, Study
from .table3 import LOOKS

FIGURES = {4386: 5, 6112: 6, 11308: 7}
PAIRS = [(gi, ipm) for ipm in METHODS[:2] for gi in METHODS[2:]] + [("GI primal", "GI dual")]
THICK = {"linewidth": 2.4, "markersize": 7.5}
THIN = {"linewidth": 0.9, "markersize": 4.0}


def write(study: Study, page: Page) -> None:
    if not study.sizes:
        return
    page.text("## Figures 5 to 7: time against active contacts")
    for n in study.sizes:
        rows = [row for row in study.rows if row["n"] == n and row["method"]]
        about = (
            f"*Working time against the active contacts, n = {n}*: Figure {FIGURES.get(n, '–')} of the "
            "paper. Seconds per load case, without data preparation. Thick: the paper's methods. Open "
            "triangles: stopped at that time; crosses: an answer outside the limit."
        )
        page.figure(f"figure-{n}", about, _drawn(rows))
    about = (
        "*Where one method overtakes the other* as more contacts close: linear interpolation of the "
        "logarithm of the seconds in the active share. Beside a stopped run, only the interval is known."
    )
    lines = [
        {"n": n, "of": a, "and": b, "crossing, active in % of m": crossings(study, n, a, b)}
        for n in study.sizes
        for a, b in PAIRS
    ]
    page.table("crossings", about, lines)


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


def _drawn(rows: list[Row]) -> Figure:
    others = pd.DataFrame([row for row in rows if row["method"] not in METHODS])
    looks = {name: look | THICK for name, look in LOOKS.items()}
    looks |= {name: look | THIN for name, look in style.line_styles(others).items()} if len(others) else {}
    drawing = style.figure(4.2)
    axes = drawing.add_subplot()
    for name, look in looks.items():
        line = [row for row in rows if row["method"] == name]
        known = [(row["active"], row["at_least"]) for row in line if not row["cut"]]
        axes.plot([x for x, _ in known], [math.nan if y is None else y for _, y in known], **look)
        for row in line:
            if row["cut"]:
                axes.plot(row["active"], row["at_least"], "^", color=look["color"], markerfacecolor="none")
            elif row["verdict"] == "outside":
                axes.plot(row["active"], row["load_case_s"], "x", color=look["color"], markersize=8)
    axes.set(xlabel="active contacts", ylabel="working time, s", yscale="log")
    style.plain_log(axes.yaxis)
    style.percent_above(axes, rows[0]["m"])
    occurring = {row["method"] for row in rows}
    handles = style.legend_entries({name: looks[name] for name in looks if name in occurring})
    drawing.legend(handles=handles, loc="outside right upper", handlelength=3.2)
    return drawing
