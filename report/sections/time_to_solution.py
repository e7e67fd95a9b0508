"""How fast is it, from the scene on? Against libraries and textbook methods, and stage by stage."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure as Drawing
from matplotlib.patches import Patch

from harness.results.schema import OWNERS
from report.analysis.standings import best_tolerances, seconds_text
from report.analysis.time_to_solution import LOAD_CASES, STAGES, stage_seconds
from report.document.blocks import Block, Column, Figure, Section, Table, number, records, word
from report.document.escape import short
from report.document.numbers import MISSING, counted, significant, whole
from report.figures import style
from report.results.reader import Results
from report.results.rows import in_order

FROM_SCENE = "a load case, from the scene on"
ONE_MORE = "one more load case on a known assembly"
MADE = ("model_s", "K_s", "factors_s", "Q_s")  # before the solver's own preparation
#: The name, colour and hatch of each stage.
LOOKS = {
    "model_s": ("finite-element model", "#C9C9C9", None),
    "K_s": ("condensation", "#5A5A5A", None),
    "factors_s": ("factors of K", style.PURPLE, None),
    "Q_s": ("Q", style.VERMILLION, "xxxx"),
    "once_s": ("preparation", style.GREEN, None),
    "solving_s": ("set-up and solve", style.BLUE, None),
    "recovery_s": ("p and x of the dual", style.SKY, "...."),
}
MOST = 12  # lines of a panel
LONGEST = 60  # characters of a name
ROW, AROUND = 0.19, 0.45  # inches: a bar; the title and the axis of a panel


def how_fast(results: Results) -> Section | None:
    """The seconds of ours, and libraries and textbook methods as multiples, over all solvers and forms."""
    table = ours_and_others(results)
    machines = " and ".join(sorted({*results.rows["machine"], *results.rounds["machine"]}))
    return None if table.empty else Section("How fast is it?", [how_fast_table(table, f" On {machines}.")])


def how_fast_table(table: pd.DataFrame, machines: str = "") -> Table:
    """A table of lines as `ours_and_others` makes them. machines : a sentence on where they were measured."""
    columns = [
        word("question", "question"),
        number("n", "n", whole),
        number("scenes", "scenes", whole),
        Column("ours, s (worst scene)", _seconds),
        Column("the fastest library (least)", _times("library")),
        Column("the fastest textbook method (least)", _times("textbook")),
    ]
    caption = (
        "*How fast is it?* From the scene on: condensation, factors, Q and preparation included where a form "
        "needs them. Seconds of the fastest of ours, the median over the scenes; the others as multiples of "
        "it, the median (the least), over the scenes on which they were measured. One on which none of them "
        f"is within the limit counts as more than all others.{machines}"
    )
    return Table("how-fast", caption, table, columns, keys=2)


def _times(owner: str) -> Callable[[Mapping[str, Any]], str]:
    def text(line: Mapping[str, Any]) -> str:
        median, least = line[owner], line[f"{owner}_least"]
        if np.isnan(median):
            return MISSING
        return f"{'more' if median == float('inf') else significant(median, 2)} × ({significant(least, 2)})"

    return text


def _seconds(line: Mapping[str, Any]) -> str:
    return f"{significant(line['seconds'], 2)} ({significant(line['seconds_most'], 2)})"


def ours_and_others(results: Results) -> pd.DataFrame:
    """Per question and size n, over the scenes on which ours is within the limit:

    seconds, seconds_most : of the fastest of ours, the median and the worst scene
    library, library_least : how many times as long the fastest library takes, the median and the least
    library_none : the scenes on which libraries were measured and none is within the limit; they count as
        more than all others, scenes without a library not at all
    textbook, … : the same for the textbook methods

    What was measured beside a round of ours (suite.py, `beside`) is compared with the fastest of that round.
    Empty unless libraries and textbook methods were measured on these scenes, in sparse and in dense forms.
    """
    rows = pd.concat([results.rows, results.rounds], ignore_index=True)
    cells_by_stage = stage_seconds(replace(results, rows=rows))
    if cells_by_stage.empty or not set(OWNERS) <= set(cells_by_stage["owner"]):
        return pd.DataFrame()
    within = cells_by_stage["verdict"] == "within"
    beside = cells_by_stage["round"].where(cells_by_stage["round"] != "", cells_by_stage["beside_round"])
    at, ours = [cells_by_stage["machine"], cells_by_stage["scene"], beside], cells_by_stage["owner"] == "ours"
    lines: list[dict[str, Any]] = []
    for question, seconds in ((FROM_SCENE, "total_1_s"), (ONE_MORE, "load_case_s")):
        taken = cells_by_stage[seconds].where(within, np.inf)
        if taken.isna().any():  # the seconds of a stage are not known
            continue
        own = taken.where(ours & np.isfinite(taken))
        alone = own.where(beside == "").groupby(cells_by_stage["scene"]).transform("min")
        times = (taken / own.groupby(at).transform("min")).where(cells_by_stage["round"] == "")
        cells_by_stage = cells_by_stage.assign(fastest=(times * alone).where(np.isfinite(taken) | ~ours))
        fastest = cells_by_stage.groupby(["n", "scene", "owner"])["fastest"].min().unstack("owner")
        solved = fastest.reindex(columns=list(OWNERS)).dropna(subset="ours")
        lines += [
            {"question": question, "n": n} | against_ours(of_size) for n, of_size in solved.groupby("n")
        ]
    return pd.DataFrame(lines)


def against_ours(fastest: pd.DataFrame) -> dict[str, Any]:
    """The figures of one question. fastest : seconds, a row per scene, a column per owner; infinite where
    none is within the limit, not a number where none was measured.
    """
    line: dict[str, Any] = {"scenes": len(fastest), "seconds": fastest["ours"].median()}
    line["seconds_most"] = fastest["ours"].max()
    for owner in OWNERS[1:]:
        times = fastest[owner] / fastest["ours"]
        line |= {owner: times.median(), f"{owner}_least": times[np.isfinite(times)].min()}
        line[f"{owner}_none"] = int(np.isinf(times).sum())
    return line


def section(results: Results) -> Section | None:
    """Seconds of each stage, in a run with sparse and dense forms."""
    lines = stage_seconds(results)
    if lines.empty:
        return None
    order = in_order(lines)
    made_s = lines[[*MADE]].sum(axis=1, skipna=False)
    table = lines.assign(place=lines["label"].map(order.index), made_s=made_s)
    table = table.sort_values(["n", "active", "scene", "total_1_s", "place"])
    kept = ["scene", "n", "m", "active", "label", "threads", "tolerance", "status", "verdict"]
    kept += [*STAGES, "made_s", *(f"total_{k}_s" for k in LOAD_CASES)]
    kept += ["stored_mib", "peak_rss_mib", "load_case_s", "time_limit_s"]
    columns = [word("scene", "scene"), word("solver (form)", "label"), number("matrices, s", "made_s")]
    columns += [Column(f"{counted(k, 'load case')}, s", partial(_total, load_cases=k)) for k in LOAD_CASES]
    columns += [
        number("dense matrices, MiB", "stored_mib", whole),
        number("peak, MiB", "peak_rss_mib", whole),
    ]
    caption = (
        "*From the scene to the answer*, medians of the repeats, totals of several load cases extrapolated. "
        "Cached matrices count with the seconds that they took to make."
    )
    blocks: list[Block] = [Table("roads", caption, table[kept], columns, keys=2)]
    best = best_tolerances(lines[lines["total_1_s"].notna()])
    scenes = best.drop_duplicates("scene").sort_values(["n", "active", "scene"]).groupby("n")["scene"]
    answered = best[best["scene"].isin([*scenes.first(), *scenes.last()])]  # of each size, fewest and most
    answered = answered[answered.groupby("scene")["method"].transform("nunique") > 1]
    if len(answered):
        caption = (
            "*From the scene to the answer of one load case*, the fastest first, in seconds; of each size, "
            "the scenes with the fewest and the most active contacts."
        )
        blocks.insert(0, Figure("roads", caption, _stacked(answered)))
    return Section("From scene to answer", blocks)


def _total(line: Mapping[str, Any], load_cases: int) -> str:
    if line["verdict"] == "within":
        return significant(line[f"total_{load_cases}_s"])
    return seconds_text(line) if load_cases == LOAD_CASES[0] else ""


def _stacked(lines: pd.DataFrame) -> Drawing:
    """A panel of bars for each scene, the fastest MOST lines of it."""
    scenes = [
        of.sort_values("total_1_s").head(MOST)
        for _, of in lines.groupby(["n", "active", "scene"], dropna=False)
    ]
    heights = [AROUND + ROW * len(of) for of in scenes]
    drawing = style.figure(sum(heights) + 0.5)
    panels = drawing.subplots(len(scenes), 1, height_ratios=heights, squeeze=False)[:, 0]
    for axes, of in zip(panels, scenes, strict=True):
        ends = np.zeros(len(of))
        for name, (_, color, hatch) in LOOKS.items():
            look: Any = {"color": color, "hatch": hatch, "edgecolor": "white", "linewidth": 0.4}
            axes.barh(np.arange(len(of)), of[name], left=ends, height=0.74, **look)
            ends += of[name].to_numpy(dtype=float)
        for place, line in enumerate(records(of)):
            at: Any = {"textcoords": "offset points", "va": "center", "fontsize": 8}
            axes.annotate(significant(line["total_1_s"]), (ends[place], place), (4, 0), **at)
        axes.set(xlim=(0, 1.14 * ends.max()), ylim=(len(of) - 0.5, -0.5))
        axes.set_yticks(range(len(of)), [short(name, LONGEST) for name in of["method"]])
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False, axis="y")
        axes.set_title(f"n = {whole(of['n'].iloc[0])}, {whole(of['active'].iloc[0])} active")
    axes.set_xlabel("seconds")
    used = [look for name, look in LOOKS.items() if (lines[name] > 0).any()]
    handles = [Patch(facecolor=color, hatch=hatch, label=text) for text, color, hatch in used]
    drawing.legend(handles=handles, loc="outside lower center", ncols=4)
    return drawing
