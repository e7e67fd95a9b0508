"""From scene to answer: the sparse form beside the dense ones, with what it takes to make their matrices."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from report.analysis.drawn import with_rivals
from report.analysis.roads import LOAD_CASES, STAGES, fastest, roads
from report.analysis.seconds import seconds_text
from report.analysis.standings import TIE
from report.document.blocks import Block, Column, Figure, Place, Section, Table, Text, number, records, word
from report.document.numbers import counted, listed, significant, span, whole
from report.figures import style
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(125)

MADE = ("model_s", "K_s", "factors_s", "Q_s")  # before the solver's own preparation
COLUMNS = 2  # of panels
ROW = 0.19  # inches
DRAWN = 12  # lines per panel, at most
LOOK: dict[str, tuple[str, str, str | None]] = {
    "model_s": ("finite-element model", "#C9C9C9", None),
    "K_s": ("condensation", "#5A5A5A", None),
    "factors_s": ("factors of K", style.PURPLE, None),
    "Q_s": ("Q", style.VERMILLION, "xxxx"),
    "once_s": ("preparation", style.GREEN, None),
    "solving_s": ("set-up and solve", style.BLUE, None),
    "recovery_s": ("p and x of the dual", style.SKY, "...."),
}
COUNTED = (
    "The dense forms' condensation, factors of K and Q are cached, and shared by all load cases and "
    "solvers. Here they count as if they were not, with the seconds that each took to make; condensation "
    "includes the finite-element model. Factors and Q count where a solver used them. In the sparse form "
    "the model is made by the measuring process, and factors of K̂ belong to the preparation. The first "
    "load case pays for everything, each further one for set-up, solve, and the dual's p and x. Imports, "
    "condition numbers and the reference are not included."
)


def section(results: Results) -> Section | None:
    lines = roads(results)
    if lines.empty:
        return None
    best = fastest(lines)
    blocks: list[Block] = [Text(f"{_sentences(best)}{COUNTED}")]
    if len(best):
        blocks += [_figure(lines), _fastest(best)]
    return Section("From scene to answer", [*blocks, _table(lines)])


def _sentences(best: pd.DataFrame) -> str:
    """For each number of load cases who is the fastest on how many scenes, and by how much."""
    if best.empty:
        return "No answer is within the limit.\n\n"
    lines = []
    for k in LOAD_CASES:
        of = best[best["load_cases"] == k]
        winners = [_winner(method, of[of["method"] == method], len(of)) for method in _by_wins(of)]
        lines.append(f"- {counted(k, 'load case')}: {'; '.join(winners)}.")
    return (
        "The fastest from the scene to x and λ within the limit, in any form:\n\n" + "\n".join(lines) + "\n\n"
    )


def _by_wins(best: pd.DataFrame) -> list[str]:
    return [str(method) for method in best["method"].value_counts().index]


def _winner(method: str, won: pd.DataFrame, scenes: int) -> str:
    where = f"on {len(won)} of {counted(scenes, 'scene')}"
    ratios = [_times(won["to_next"], "the next")]
    if won["in_house"].all():
        ratios.append(_times(won["to_library"], "the fastest library"))
    known = [text for text in ratios if text]
    return f"**{method}** {where}" + (f", {listed(known)}" if known else "")


def _times(ratios: pd.Series[float], what: str) -> str:
    if ratios.isna().any():
        return ""
    if ratios.max() <= TIE:
        return f"about as fast as {what}"
    return f"{span(significant(ratios.min(), 2), significant(ratios.max(), 2))} times as fast as {what}"


def _fastest(best: pd.DataFrame) -> Table:
    columns = [
        word("scene", "scene"),
        number("n", "n", whole),
        number("load cases", "load_cases", whole),
        word("fastest", "method"),
        number("total, s", "seconds"),
        word("next", "next"),
        number("next / fastest", "to_next"),
        word("fastest library", "library"),
        number("library / fastest", "to_library"),
    ]
    caption = "*The fastest from scene to answer*, in any form, of the answers within the limit."
    return Table("roads-fastest", caption, best, columns)


def _table(lines: pd.DataFrame) -> Table:
    names = in_order(lines)
    table = lines.assign(place=lines["label"].map(names.index))
    table = table.sort_values(["n", "active", "scene", "total_1_s", "place"])
    kept = [
        "scene",
        "n",
        "m",
        "active",
        "label",
        "solver",
        "form",
        "variant",
        "threads",
        "tolerance",
        "status",
    ]
    kept += [
        "verdict",
        *STAGES,
        *(f"total_{k}_s" for k in LOAD_CASES),
        "stored_mib",
        "data_mib",
        "peak_rss_mib",
    ]
    kept += ["load_case_s", "time_limit_s"]
    columns = [word("scene", "scene"), word("solver (form)", "label")]
    columns.append(Column("matrices, s", _matrices))
    columns += [
        Column(f"total of {counted(k, 'load case')}, s", partial(_total, load_cases=k)) for k in LOAD_CASES
    ]
    columns += [
        Column("dense matrices, MiB", lambda line: whole(line["stored_mib"] or None)),
        number("peak, MiB", "peak_rss_mib", whole),
    ]
    caption = (
        "*From scene to answer*, in seconds, medians of the repeats. The totals of several load cases "
        "are extrapolated from the one measured. An answer outside the limit has none. Matrices: the "
        "finite-element model, condensation, factors of K and Q; the CSV has each. Dense matrices: K, "
        "and the factors and Q if used, which the process maps from the cache. Peak: of the measuring "
        "process, which in the sparse form makes the model, and in the dense forms condenses nothing."
    )
    return Table("roads", caption, table[kept], columns)


def _matrices(line: Mapping[str, Any]) -> str:
    return significant(sum(line[name] for name in MADE) or None)


def _total(line: Mapping[str, Any], load_cases: int) -> str:
    if line["verdict"] == "within":
        return significant(line[f"total_{load_cases}_s"])
    return seconds_text(line) if load_cases == LOAD_CASES[0] else ""


def _figure(lines: pd.DataFrame) -> Figure:
    answered = lines[lines["total_1_s"].notna()].sort_values("total_1_s").drop_duplicates(["scene", "method"])
    scenes = _drawn_scenes(answered)
    shown = [answered[answered["scene"] == scene].head(DRAWN) for scene in scenes]
    count = -(-len(shown) // COLUMNS)
    heights = [0.45 + ROW * max(map(len, shown[k * COLUMNS : (k + 1) * COLUMNS])) for k in range(count)]
    drawing = style.figure(sum(heights) + 0.15 * count + 0.7)
    panels = drawing.subplots(count, min(COLUMNS, len(shown)), height_ratios=heights, squeeze=False)
    for axes, of_scene in zip(panels.ravel(), shown, strict=False):
        _panel(axes, of_scene)
    for axes in panels.ravel()[len(shown) :]:
        axes.set_axis_off()
    for axes in panels[-1]:
        axes.set_xlabel("seconds")
    used = [name for name in STAGES if any((of_scene[name] > 0).any() for of_scene in shown)]
    handles = [Patch(facecolor=LOOK[name][1], hatch=LOOK[name][2], label=LOOK[name][0]) for name in used]
    drawing.legend(handles=handles, loc="outside lower center", ncols=4)
    caption = (
        "*From the scene to the answer of one load case*, the fastest first, with the total in seconds; "
        "on the scenes of each size with the fewest and the most active contacts. Answers outside the "
        "limit are omitted, and so are smaller sizes with one method."
    )
    return Figure("roads", caption, drawing)


def _drawn_scenes(answered: pd.DataFrame) -> list[str]:
    """Of each size the scenes with the fewest and the most active contacts, where methods can be compared."""
    answered = with_rivals(answered, answered.groupby("scene")["method"].transform("nunique"))
    found: list[str] = []
    for _, of_size in answered.drop_duplicates("scene").sort_values(["n", "active", "scene"]).groupby("n"):
        ends = of_size["scene"].tolist()
        found += dict.fromkeys([ends[0], ends[-1]])
    return found


def _panel(axes: Axes, lines: pd.DataFrame) -> None:
    places, left = np.arange(len(lines)), np.zeros(len(lines))
    for name, (_, color, hatch) in LOOK.items():
        width = lines[name].to_numpy(dtype=float)
        look: dict[str, Any] = {"color": color, "hatch": hatch, "edgecolor": "white", "linewidth": 0.4}
        axes.barh(places, width, left=left, height=0.74, **look)
        left += width
    for place, line in enumerate(records(lines)):
        text = significant(line["total_1_s"])
        axes.annotate(text, (left[place], place), (4, 0), textcoords="offset points", va="center", fontsize=8)
    axes.set(xlim=(0, 1.14 * left.max()), ylim=(len(lines) - 0.5, -0.5))
    axes.set_yticks(places, lines["method"])
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.set_title(f"n = {lines['n'].iloc[0]:.0f}, {lines['active'].iloc[0]:.0f} active")
