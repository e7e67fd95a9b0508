"""Table 3: how time and memory grow with n, on the scenes of one joint."""

from __future__ import annotations

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from report.analysis.time_to_solution import Exponent, exponent
from report.document.blocks import Figure, Section
from report.document.numbers import MISSING
from report.figures import style

from .rows import METHODS, Row, Study, table

SHORTEST_S = 1e-3  # a shorter time does not show how the work grows
#: Name in the tables → the order in n that the paper gives each family, if it gives one.
ORDERS = {
    "data preparation, s": "3",
    "of it the solver's own, s": "3",
    "working time, s": "GI 3",
    "working time over CG iterations per system, s": "IPM 2.5",
    "outer iterations": "IPM 0.5",
    "CG iterations": MISSING,
    "s per CG iteration": "IPM 2",
    "pivots": "GI 1",
    "s per pivot": "GI 2",
    "working memory, MiB": "2",
}
PREPARATION, OWN, WORKING, PER_SYSTEM, OUTER, CG, PER_CG, PIVOTS, PER_PIVOT, MEMORY = ORDERS
LOOKS: dict[str, dict[str, Any]] = {
    "IPM": {"color": style.BLUE, "marker": "o", "linestyle": "-"},
    "IPM, open gaps last": {"color": style.BLUE, "marker": "D", "linestyle": ":", "markerfacecolor": "white"},
    "GI dual": {"color": style.VERMILLION, "marker": "s", "linestyle": "-"},
    "GI primal": {"color": style.VERMILLION, "marker": "s", "linestyle": "--", "markerfacecolor": "white"},
}


def quantities(study: Study) -> list[Row]:
    """A line per scaling scene and method: n, active, method and those of ORDERS that it has, NaN without an
    answer within the limit.

    Data preparation: the Cholesky factor of K and Q (of the build), and the solver's own preparation.
    """
    build = {problem["scene"]: problem.get("build_s") or {} for problem in study.problems}
    lines = []
    for row in study.scaling:
        if row["method"] in METHODS:
            steps = [row["prepare_s"], *map(build.get(row["scene"], {}).get, ("cholesky", "Q"))]
            names = ("load_case_s", "solve_s", "iterations", "inner_iterations", "working_mib")
            known = ((row["verdict"] == "within" and row[name]) or math.nan for name in names)
            seconds, solve, outer, cg, memory = known
            line = {name: row[name] for name in ("n", "active", "method")}
            line |= {PREPARATION: math.nan if None in steps else sum(steps), OWN: row["prepare_s"]}
            line |= {WORKING: seconds, "shown": row["shown"], MEMORY: memory}
            if row["solver"] == "ipm":
                line |= {OUTER: outer, CG: cg, PER_CG: solve / cg, PER_SYSTEM: 2 * seconds * outer / cg}
            else:
                line |= {PIVOTS: outer, PER_PIVOT: solve / outer}
            lines.append(line)
    return sorted(lines, key=lambda line: (line["n"], METHODS.index(line["method"])))


def fitted(lines: list[Row], method: str, quantity: str) -> Exponent | None:
    """The exponent in n; times below SHORTEST_S do not count."""
    least = SHORTEST_S if quantity in (PREPARATION, OWN, WORKING) else 0.0
    known = [line for line in lines if line["method"] == method and (line.get(quantity) or 0.0) > least]
    return exponent([line["n"] for line in known], [line[quantity] for line in known])


def section(study: Study) -> Section | None:
    lines = quantities(study)
    if not lines:
        return None
    about = (
        "*Measured exponents in n*, with the standard error of the fit: least squares in log–log over the "
        "scenes of one joint. Data preparation: the Cholesky factor of K, Q, and the solver's own. The "
        "paper's order for the interior-point method is n^2.5 times the CG iterations per system; for "
        "Goldfarb–Idnani it is n_act·n². Only answers within the limit and times above a millisecond count."
    )
    fits: list[Row] = [
        {"quantity": quantity, "order in n, paper": order}
        | {name: str(fitted(lines, name, quantity) or MISSING) for name in METHODS}
        for quantity, order in ORDERS.items()
    ]
    data_about = (
        "*The data of the fits.* Working memory: the peak minus what was resident when the work began."
    )
    columns = ("n", "active", "method", PREPARATION, OWN, "shown", OUTER, CG, PIVOTS, MEMORY)
    headings = {"shown": WORKING}
    data: list[Row] = [{headings.get(name, name): line.get(name) for name in columns} for line in lines]
    data = [line | {"n × n matrix, MiB": 8 * line["n"] ** 2 / 2**20} for line in data]
    drawn_about = "*The same on logarithmic axes*: a power of n is a straight line, its exponent the slope."
    blocks = [table("table3", about, fits), table("scaling", data_about, data, keys=3)]
    return Section("Table 3: complexity and memory", [*blocks, Figure("table3", drawn_about, _drawn(lines))])


def _drawn(lines: list[Row]) -> Drawing:
    per_step = "s per CG iteration or pivot"
    lines = [line | {per_step: line.get(PER_CG, line.get(PER_PIVOT))} for line in lines]
    drawing = style.figure(5.6)
    panels: list[Axes] = list(drawing.subplots(2, 2, sharex=True).ravel())
    ticks = sorted({int(line["n"]) for line in lines})
    for axes, quantity in zip(panels, (PREPARATION, WORKING, per_step, MEMORY), strict=True):
        for name, look in LOOKS.items():
            of = [line for line in lines if line["method"] == name]
            axes.plot([line["n"] for line in of], [line[quantity] for line in of], label=name, **look)
        axes.set(xscale="log", yscale="log", ylabel=quantity)
        axes.set_xticks(ticks, [str(n) for n in ticks], rotation=30)
        axes.minorticks_off()
    for axes in panels[2:]:
        axes.set_xlabel("n")
    drawing.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", handlelength=3.2)
    return drawing
