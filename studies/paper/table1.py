"""Table 1: CG iterations without a preconditioner and with V = U + √D."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from report.document.blocks import Figure, Section
from report.document.numbers import tidy_power
from report.figures import style

from .lines import table
from .printed import TABLE_1
from .rows import SYSTEMS, Counts, Row, Study, counts

N = 4386  # of the printed table
PRINTED = {name: Counts(both["predictor"], both["corrector"]) for name, both in TABLE_1.items()}
#: Colour, marker and dashes of each line; the printed ones grey and black.
LOOKS = {
    "V = I, printed": (style.GREY, "v", ":"),
    "V = I": (style.VERMILLION, "s", "-"),
    "V = U + √D, printed": (style.BLACK, "^", ":"),
    "V = U + √D": (style.BLUE, "o", "-"),
    "V = U + √D, open gaps last": (style.SKY, "D", "-"),
}


def section(study: Study) -> Section | None:
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
    def cell(found: Counts, k: int) -> str:
        both = [str(kind[k]) for kind in (found.predictor, found.corrector) if k < len(kind)]
        if found.cut and k == len(found.predictor) - 1:
            both[-1] = f"≥ {both[-1]}"
        return " / ".join(both)

    length = max(len(found.predictor) for found in lines.values())
    return [
        {"iteration": k + 1} | {name: cell(found, k) for name, found in lines.items()} for k in range(length)
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
