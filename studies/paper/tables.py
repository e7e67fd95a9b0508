"""Tables 1, 2 and 4: CG iterations, the starting points on the ten loads, and the test problems."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from report.document.blocks import Figure, Section
from report.document.numbers import MISSING, significant, tidy_power, whole
from report.figures import style

from .printed import TABLE_1, TABLE_2, TABLE_4
from .rows import SCALING, SYSTEMS, Counts, Row, Study, counts, table

N = 4386  # of the printed tables 1 and 2
PRINTED = {name: Counts(both["predictor"], both["corrector"]) for name, both in TABLE_1.items()}
#: Colour, marker and dashes of each line; the printed ones grey and black.
LOOKS = {
    "V = I, printed": (style.GREY, "v", ":"),
    "V = I": (style.VERMILLION, "s", "-"),
    "V = U + √D, printed": (style.BLACK, "^", ":"),
    "V = U + √D": (style.BLUE, "o", "-"),
    "V = U + √D, open gaps last": (style.SKY, "D", "-"),
}


def cg_iterations(study: Study) -> Section | None:
    base = [row for row in study.ipm(preconditioner="none").values() if row["n"] == N and counts(row)]
    if not base:
        return None
    scene = base[len(base) // 2]  # by active contacts
    ours = {name: counts(study.ipm(**SYSTEMS[name]).get(scene["scene"])) for name in SYSTEMS}
    printed = {f"{name}, printed": found for name, found in PRINTED.items()}
    lines = {name: found for name in LOOKS if (found := (printed | ours).get(name))}
    totals = "; ".join(f"{name}: {found}" for name, found in lines.items())
    about = (
        f"*CG iterations of each outer iteration, predictor / corrector*, scene {scene['scene']} "
        f"({scene['active']:.0f} of {scene['m']:.0f} active), to a relative residual of "
        f"{tidy_power(scene['asked']['cg_tolerance'])} and ε_μ = {tidy_power(scene['tolerance'])} N·mm. "
        "The paper does not state its load, order of the nodes and tolerances. Summed over the solve: "
        f"{totals}. ≥: stopped there."
    )
    figure = Figure("table1", "*The same counts.* Dotted, with triangles: printed.", _drawn(lines))
    return Section("Table 1: CG iterations", [table("table1", about, _by_iteration(lines)), figure])


def _by_iteration(lines: dict[str, Counts]) -> list[Row]:
    def cell(counts: Counts, k: int) -> str:
        both = [str(kind[k]) for kind in (counts.predictor, counts.corrector) if k < len(kind)]
        if counts.cut and k == len(counts.predictor) - 1:
            both[-1] = f"≥ {both[-1]}"
        return " / ".join(both)

    length = max(len(counts.predictor) for counts in lines.values())
    return [
        {"iteration": k + 1} | {name: cell(each, k) for name, each in lines.items()} for k in range(length)
    ]


def _drawn(lines: dict[str, Counts]) -> Drawing:
    drawing = style.figure(3.6)
    panels: list[Axes] = list(drawing.subplots(1, 2, sharey=True))
    for axes, kind in zip(panels, ("predictor", "corrector"), strict=True):
        for name, found in lines.items():
            color, marker, dashes = LOOKS[name]
            face = "white" if "printed" in name else color
            values = getattr(found, kind)
            look: dict[str, Any] = {"marker": marker, "markerfacecolor": face, "linestyle": dashes}
            axes.plot(range(1, len(values) + 1), values, markersize=4, color=color, label=name, **look)
        axes.set(yscale="log", xlabel="outer iteration", title=kind)
    panels[0].set_ylabel("CG iterations")
    drawing.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", handlelength=3.2)
    return drawing


STARTS = {"stp1": "STP1", "stp2": "STP2", "algorithm_5": "Algorithm 5", "mehrotra": "Mehrotra"}
RIVALS = ("stp1", "stp2")


def loads(study: Study) -> dict[int, dict[str, Row]]:
    """By printed number of active contacts: the row of each start that was measured."""
    of_start = {start: study.ipm(start=start) for start in STARTS}
    return {
        active: {start: rows[scene] for start, rows in of_start.items() if scene in rows}
        for active in TABLE_2
        for scene in (f"{N}/{active:04d}",)
    }


def iterations(row: Row | None) -> int | None:
    """The iterations of a row; None without an answer."""
    return int(row["iterations"]) if row and row["verdict"] != "no_answer" else None


def starting_points(study: Study) -> Section | None:
    measured = loads(study)
    if not any(rival in rows for rows in measured.values() for rival in RIVALS):
        return None
    lines = []
    for active, rows in measured.items():
        line: Row = {"active, printed": active}
        line["ours"] = max((row["active"] for row in rows.values()), default=None)
        for start, name in STARTS.items():
            row, (its, seconds) = rows.get(start), TABLE_2[active].get(start, (None, None))
            line[f"{name}: iterations"] = _beside(whole(iterations(row)), whole(its))
            line[f"{name}: s"] = _beside(row["shown"] if row else MISSING, significant(seconds))
        lines.append(line)
    about = (
        "*The starting points on the ten loads, ours | printed*: iterations, and seconds per load case, the "
        "printed ones on the paper's machine. The paper does not state its ε_μ. STP1 and STP2 are as read "
        "from a secondary source; Mehrotra's start is not in the paper."
    )
    return Section("Table 2: starting points", [table("table2", about, lines, keys=2)])


def _beside(ours: str, printed: str) -> str:
    return ours if printed == MISSING else f"{ours} | {printed}"


def test_problems(study: Study) -> Section:
    ours = {p["n"]: p for p in study.problems if not p["scene"].startswith(SCALING)}
    lines: list[Row] = []
    for problem, n, m, cond in TABLE_4:
        here = ours.get(n, {})
        found = here.get("cond_K")
        line = {"problem": problem, "n": here.get("n"), "n, printed": n, "m": here.get("m"), "m, printed": m}
        line |= {"cond(K)": found, "cond(K), printed": cond}
        lines.append(line | {"difference": f"{found / cond - 1:+.2%}" if found else None})
    about = "*The test problems.* Ours are plate models of our own with the paper's nodes and constraints."
    return Section("Table 4: test problems", [table("table4", about, lines)])
