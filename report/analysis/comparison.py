"""Compares two runs, measurement by measurement; those that became worse come first.

Repeats are merged so that nothing looks better than it was: the worst verdict with its status, the largest
error, the median of the iterations and of the seconds per load case t = set-up + solve + form. The ratio of
times, median over median, has the interval

    [least t_new / most t_old, most t_new / least t_old]

over the repeats. A side with fewer than three is taken to vary by the factor TIE, as single runs do. With
three on each side, all of the new ones are slower by chance alone once in 20 times.

The other measurements show how much single runs vary on this machine. With SEVERAL or more ratios r, their
median r₀, and the median s of |log r − log r₀|, a ratio is a change beyond

    r₀ exp(5 · 1.4826 s).

So a machine that was slower, or more restless, during one of the runs does not count as a change.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import numpy as np
import pandas as pd

from harness.results.comparison import digits_lost, floor_mm
from harness.results.schema import VERDICTS
from report.results.rows import cells_of

from .standings import TIE

ENOUGH = 3  # repeats whose spread says how much times vary
SEVERAL = 8  # measurements whose ratios say how much single runs vary
MISSING = "not measured"
WORSE, CHANGED, BETTER, ADDED, SAME = "worse", "another status", "better", "new", "alike"
#: The kinds of lines in their order, and their groups.
GONE, JUDGED_WORSE, DIGITS, SLOWER, OTHER_STATUS, GAINED, NEW, UNCHANGED = range(8)
GROUPS = (WORSE, WORSE, WORSE, WORSE, CHANGED, BETTER, ADDED, SAME)


def compared(
    old: pd.DataFrame, new: pd.DataFrame, timed: bool, max_digits_lost: float, max_slowdown: float
) -> pd.DataFrame:
    """One line per measurement of either side. old, new : rows with their `measurement`.

    timed : whether times can be compared. Beside the figures of both sides, with the endings _old and _new:
    `digits_lost`, `ratio` with `ratio_least` and `ratio_most`, `group`, and `change` in words.
    """
    older, newer = merged(old).add_suffix("_old"), merged(new).add_suffix("_new")
    table = older.join(newer, how="outer").reset_index()
    for side in ("old", "new"):
        for name in ("verdict", "status"):
            table[f"{name}_{side}"] = table[f"{name}_{side}"].fillna(MISSING)
    table["digits_lost"] = [_digits(*line) for line in zip(*_errors(table), strict=True)]
    if timed:
        table["ratio"] = table["seconds_new"] / table["seconds_old"]
        table["ratio_least"] = table["least_s_new"] / table["most_s_old"]
        table["ratio_most"] = table["most_s_new"] / table["least_s_old"]
        _widen(table)
    else:
        table[["ratio", "ratio_least", "ratio_most"]] = np.nan
    changes = [_change(line, max_digits_lost, max_slowdown) for line in table.to_dict("records")]
    table[["kind", "change", "size"]] = pd.DataFrame(changes, table.index, ["kind", "change", "size"])
    order = {"kind": True, "size": False, "measurement": True}
    table["group"] = [GROUPS[kind] for kind in table["kind"]]
    ordered = table.sort_values([*order], ascending=[*order.values()], ignore_index=True)
    return ordered.drop(columns=["kind", "size"])


def merged(rows: pd.DataFrame) -> pd.DataFrame:
    """One line per measurement, its repeats merged. Seconds of answers outside the limit are missing."""
    cells = cells_of(rows, ["measurement"]).set_index("measurement")
    cells["load_case_s"] = cells["load_case_s"].where(cells["verdict"] != "outside")
    vary = np.where(cells["repeats"] < ENOUGH, TIE, 1.0)
    cells["least_s"] = np.minimum(cells["least_s"], cells["load_case_s"] / vary)
    cells["most_s"] = np.maximum(cells["most_s"], cells["load_case_s"] * vary)
    shown = ["scene", "solver", "verdict", "status", "limit_mm", "iterations", "repeats", "least_s", "most_s"]
    return cells[shown].assign(
        error_mm=cells["displacement_error_mm"],
        bound_mm=cells["reference_bound_mm"],
        seconds=cells["load_case_s"].where(cells["load_case_s"].between(0.0, np.inf, inclusive="neither")),
    )


def _widen(table: pd.DataFrame) -> None:
    """Widen the intervals of single runs to the spread of all their ratios."""
    single = table[["repeats_old", "repeats_new"]].min(axis=1) < ENOUGH
    logs = np.log(table.loc[single, "ratio"].dropna())
    if len(logs) < SEVERAL:
        return
    usual = logs.median()
    spread = 5 * 1.4826 * (logs - usual).abs().median()
    ratio = table.loc[single, "ratio"]
    least, most = ratio / np.exp(spread + max(usual, 0.0)), ratio * np.exp(spread - min(usual, 0.0))
    table.loc[single, "ratio_least"] = np.minimum(table.loc[single, "ratio_least"], least)
    table.loc[single, "ratio_most"] = np.maximum(table.loc[single, "ratio_most"], most)


def _errors(table: pd.DataFrame) -> list[pd.Series[float]]:
    bounds = table[["bound_mm_old", "bound_mm_new"]].max(axis=1)
    limits = table["limit_mm_old"].fillna(table["limit_mm_new"])
    return [table["error_mm_old"], table["error_mm_new"], bounds, limits]


def _digits(old: float, new: float, bound: float, limit: float) -> float:
    floor = floor_mm(bound, limit)
    return digits_lost(old, new, floor) if np.isfinite([old, new, floor]).all() and floor > 0 else np.nan


def _change(line: dict[Hashable, Any], max_digits_lost: float, max_slowdown: float) -> tuple[int, str, float]:
    """The kind of a line, its change in words, and the size of the change among lines of that kind."""
    old, new = line["verdict_old"], line["verdict_new"]
    lost, ratio = line["digits_lost"], line["ratio"]
    if new == MISSING:
        return GONE, "no longer measured", 0.0
    if old == MISSING:
        return NEW, "new", 0.0
    verdict, ranks = f"{_words(old)} → {_words(new)}", VERDICTS.index(new) - VERDICTS.index(old)
    if ranks > 0:
        return JUDGED_WORSE, verdict, ranks
    if lost > max_digits_lost:
        return DIGITS, f"{lost:.1f} digits lost", lost
    if ratio > max_slowdown and line["ratio_least"] > 1:
        return SLOWER, f"{ratio:.2f} times as long", ratio
    if ranks < 0:
        return GAINED, verdict, np.inf
    if lost < -max_digits_lost:
        return GAINED, f"{-lost:.1f} digits gained", -lost
    if ratio < 1 / max_slowdown and line["ratio_most"] < 1:
        return GAINED, f"{1 / ratio:.2f} times as fast", 0.0
    if line["status_old"] != line["status_new"]:
        return OTHER_STATUS, f"{_words(line['status_old'])} → {_words(line['status_new'])}", 0.0
    return UNCHANGED, "", 0.0


def _words(name: str) -> str:
    return name.replace("_", " ")


def by_solver(table: pd.DataFrame) -> pd.DataFrame:
    """One line per solver: its measurements on both sides, how many became worse or better, the digits lost
    in the median and at most, and the geometric mean of the ratios of times.
    """
    both = table[(table[["verdict_old", "verdict_new"]] != MISSING).all(axis=1)]
    both = both.assign(worse=both["group"] == WORSE, better=both["group"] == BETTER)
    both["ratio"] = np.log(both["ratio"])
    lines = both.groupby("solver_new").agg(
        measurements=("group", "size"),
        worse=("worse", "sum"),
        better=("better", "sum"),
        digits_lost=("digits_lost", "median"),
        most_digits_lost=("digits_lost", "max"),
        ratio=("ratio", "mean"),
    )
    return lines.assign(ratio=np.exp(lines["ratio"])).rename_axis("solver").reset_index()
