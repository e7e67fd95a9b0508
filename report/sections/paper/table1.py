"""Table 1: CG iterations without a preconditioner and with V = U + √D, by outer iteration."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd
from matplotlib.axes import Axes

from report.analysis.paper.cg import SYSTEMS, Counts, counts, system_name
from report.analysis.paper.selection import asked, cells_of_paper, first, ipm, is_paper, of_problems
from report.analysis.paper.targets import late_target, ratio_target
from report.analysis.seconds import seconds_text
from report.document.blocks import Block, Column, Figure, Place, Section, Table, Text, number, records, word
from report.document.numbers import MISSING, listed, significant, tidy_power, whole
from report.figures import style
from report.results.printed import TABLE_1
from report.results.reader import Results

PLACE = Place(220)

PRINTED_N = 4386
SHOWN = ("V = I", "V = U + √D", "V = U + √D, open gaps last")
#: Colour, marker of each line of the figure; the printed ones grey and black.
LOOKS = {
    ("printed", "V = I"): (style.GREY, "v", ":"),
    ("ours", "V = I"): (style.VERMILLION, "s", "-"),
    ("printed", "V = U + √D"): (style.BLACK, "^", ":"),
    ("ours", "V = U + √D"): (style.BLUE, "o", "-"),
    ("ours", "V = U + √D, open gaps last"): (style.SKY, "D", "-"),
}


def section(results: Results) -> Section | None:
    if not is_paper(results):
        return None
    cells = of_problems(cells_of_paper(results))
    blocks: list[Block] = []
    scene = _scene(cells)
    if scene is not None:
        blocks += _by_iteration(cells[cells["scene"] == scene])
    compared = _systems(cells)
    if compared is not None:
        blocks += [compared, Text(_judged(cells))]
    return Section("Table 1: CG iterations", blocks) if blocks else None


def _scene(cells: pd.DataFrame) -> str | None:
    """The scene of Table 1's size with the median active count, of those that have counts of V = I."""
    rows = ipm(cells[cells["n"] == PRINTED_N], preconditioner="none")
    have = [row["scene"] for row in records(rows) if counts(row)]
    return have[len(have) // 2] if have else None


def _by_iteration(cells: pd.DataFrame) -> list[Block]:
    rows = {name: first(ipm(cells, **SYSTEMS[name])) for name in SHOWN}
    ours = {name: found for name, row in rows.items() if (found := counts(row))}
    printed = {name: Counts(**both, cut=False) for name, both in TABLE_1.items()}
    length = max(len(c.predictor) for c in [*ours.values(), *printed.values()])
    lines, columns = [{"iteration": k + 1} for k in range(length)], [number("iteration", "iteration", whole)]
    for who, name, found in _in_turn(printed, ours):
        for kind in ("predictor", "corrector"):
            key = f"{who} {name} {kind}"
            for k, line in enumerate(lines):
                line[key] = found.text(kind, k)  # type: ignore[assignment]
            columns.append(Column(f"{name}, {who}: {kind}", _shown(key)))
    totals = "; ".join(
        f"{name}, {who}: {'≥ ' if found.cut else ''}{found.total}"
        for who, name, found in _in_turn(printed, ours)
    )
    missing = [_why_missing(name, row) for name, row in rows.items() if name not in ours]
    caption = (
        f"*CG iterations of each outer iteration*, {_setting(rows)} Printed: Table 1 of the paper, whose "
        f"load, node ordering, CG tolerance and ε_μ are not stated. Summed over the solve: {totals}. "
        "≥: stopped there, at the largest number of CG iterations in total." + "".join(missing)
    )
    figure = Figure(
        "paper-table1",
        "*CG iterations against the outer iteration*, predictor and corrector; the same counts as in the "
        "table. Dotted with triangles: printed.",
        _drawn(printed, ours),
    )
    return [Table("paper-table1", caption, pd.DataFrame(lines), columns), figure]


def _in_turn(printed: dict[str, Counts], ours: dict[str, Counts]) -> list[tuple[str, str, Counts]]:
    both = [("printed", printed), ("ours", ours)]
    return [(who, name, found[name]) for name in SHOWN for who, found in both if name in found]


def _shown(key: str) -> Callable[[Mapping[str, Any]], str]:
    return lambda row: row[key]


def _setting(rows: dict[str, dict[str, Any] | None]) -> str:
    """The scene, the tolerances and the orderings of our columns."""
    known = [row for row in rows.values() if row]
    row = known[0]
    tolerances = sorted({asked(r["options"])["cg_tolerance"] for r in known})
    mu = sorted({r["tolerance"] for r in known})
    return (
        f"scene {row['scene']} ({row['active']:.0f} of {row['m']:.0f} active). Ours: CG to a relative "
        f"preconditioned residual of {listed([tidy_power(t) for t in tolerances])}, outer iterations to "
        f"ε_μ = {listed([tidy_power(t) for t in mu])} N·mm, nodes in lexicographic order unless the column "
        "states open gaps last."
    )


def _why_missing(name: str, row: dict[str, Any] | None) -> str:
    return f" {name}: not measured." if row is None else f" {name}: no counts ({seconds_text(row)} s)."


def _drawn(printed: dict[str, Counts], ours: dict[str, Counts]) -> Any:
    drawing = style.figure(3.6)
    panels: list[Axes] = list(drawing.subplots(1, 2, sharey=True))
    for axes, kind in zip(panels, ("predictor", "corrector"), strict=True):
        for who, name, found in _in_turn(printed, ours):
            color, marker, line = LOOKS[who, name]
            values = getattr(found, kind)
            axes.plot(
                range(1, len(values) + 1), values, label=f"{name}, {who}", color=color, marker=marker,
                linestyle=line, markersize=4, markerfacecolor="white" if who == "printed" else color,
            )  # fmt: skip
        axes.set(yscale="log", xlabel="outer iteration", title=kind)
    panels[0].set_ylabel("CG iterations")
    drawing.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper", handlelength=3.2)
    return drawing


def _systems(cells: pd.DataFrame) -> Table | None:
    """Every way to solve the systems, on the scenes with more than V."""
    lines = []
    for scene in cells["scene"].unique():
        rows = [r for r in records(cells[cells["scene"] == scene]) if _is_system(r)]
        if len({asked(r["options"])["preconditioner"] for r in rows}) < 2:
            continue
        base = first(ipm(cells[cells["scene"] == scene], preconditioner="none"))
        lines += [_line(row, base) for row in sorted(rows, key=_rank)]
    if not lines:
        return None
    columns = [
        word("scene", "scene"),
        word("systems solved by", "system"),
        word("status", "status"),
        number("outer iterations", "iterations", whole),
        word("CG iterations", "cg_text"),
        word("largest in second half", "late_text"),
        word("V = I, times as many", "ratio_text"),
        word("s per load case", "seconds"),
    ]
    caption = (
        "*The ways to solve the Newton systems*, one solve each, all starting from Algorithm 5. CG "
        "iterations: predictor and corrector, summed over the solve; ≥ and >: stopped, so the true number "
        "is larger. Largest in second half: per system, over the second half of the outer iterations. "
        "Factorisations: Cholesky, within the solve. CG to a relative preconditioned residual of 1e-3 "
        "unless stated."
    )
    return Table("paper-systems", caption, pd.DataFrame(lines), columns)


def _is_system(row: dict[str, Any]) -> bool:
    return row["solver"] == "ipm" and asked(row["options"])["start"] == "algorithm_5"


def _rank(row: dict[str, Any]) -> tuple[bool, bool, int, str]:
    given = asked(row["options"])
    plain = system_name({k: given[k] for k in ("preconditioner", "ordering")})
    place = list(SYSTEMS).index(plain) if plain in SYSTEMS else len(SYSTEMS)
    return (given["scheme"] != "algorithm_3", given["cg_tolerance"] != 1e-3, place, row["variant"])


def _line(row: dict[str, Any], base: dict[str, Any] | None) -> dict[str, Any]:
    """A line of the table; `base`: the row of V = I on the same scene."""
    found = counts(row)
    none = counts(base) if base and base["variant"] != row["variant"] else None
    direct = asked(row["options"])["preconditioner"] == "direct"
    total = 0 if direct else found.total if found else None
    line = {name: row[name] for name in ("scene", "n", "variant", "iterations", "load_case_s")}
    line |= {"system": system_name(row["options"]), "status": str(row["status"]).replace("_", " ")}
    line |= {"cg": total, "cg_is_lower_bound": bool(found and found.cut)}
    line["late"] = found.late if found and not direct else None
    line["factorisations"] = row["details"].get("factorisations") or row["details"].get("reorderings") or 0
    line["ratio"] = none.total / total if none and total else None
    bound = "≥ " if found and found.cut else ""
    line["cg_text"] = MISSING if total is None else f"{bound}{total}"
    line["late_text"] = MISSING if line["late"] is None else f"{bound}{line['late']}"
    line["ratio_text"] = _ratio_text(line["ratio"], none, found)
    line["seconds"] = seconds_text(row)
    return line


def _ratio_text(ratio: float | None, none: Counts | None, found: Counts | None) -> str:
    if ratio is None or none is None or found is None or (none.cut and found.cut):
        return MISSING
    return ("≥ " if none.cut else "≤ " if found.cut else "") + significant(ratio)


def _judged(cells: pd.DataFrame) -> str:
    sentences = [*ratio_target(cells), *late_target(cells)]
    return "**Requirements on V.** " + (" ".join(sentences) or "V = U + √D was not measured.")
