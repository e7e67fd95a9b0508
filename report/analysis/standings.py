"""The ranking of the solvers, and the one rule of all advice.

Advised is the fastest line whose answer is good on every scene of a size, by the geometric mean of its
seconds over these scenes. Good: within the limit, or with an error of at most a given accuracy.
Seconds are those per load case; of a run that was stopped, only a lower bound is known.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import pandas as pd

from harness.results.schema import ANSWERED
from report.document.numbers import MISSING, significant
from report.results.reader import Results
from report.results.rows import CELL, in_order

#: The accuracies for which costs and settings are given, mm.
ACCURACIES = (1e-3, 1e-5, 1e-7, 1e-9)
#: The fewest tolerances of one method on one scene that make a curve.
CURVE_POINTS = 3
ZERO_ERROR_MM = 1e-16  # counts as an error of zero
#: A reference whose error bound exceeds this share of an accuracy cannot judge it.
BOUND_SHARE = 0.1
#: Lines that take at most this many times as long as the fastest count as equally fast: single runs on a
#: shared machine vary by as much.
TIE = 1.15
SHIFT_S = 1.0
#: A chart shows the methods that were run on at least this share of its scenes.
SHOWN = 0.5
NOT_RUN = ("unsupported", "not_run")
ROUND = ["scene", "threads_asked"]


def with_errors(cells: pd.DataFrame) -> pd.DataFrame:
    """The cells with `error`, mm: the displacement error, at least the reference error bound; missing if
    there was no answer.
    """
    bound = cells.groupby("scene")["reference_bound_mm"].transform("max")
    measured = cells["displacement_error_mm"].where(cells["load_case_s"].notna())
    return cells.assign(reference_bound_mm=bound, error=measured.clip(lower=bound).clip(lower=ZERO_ERROR_MM))


def curves(cells: pd.DataFrame) -> set[str]:
    """The methods with at least CURVE_POINTS tolerances on a scene."""
    tolerances = cells.groupby(["method", "scene"])["tolerance"].nunique()
    return set(tolerances.index.get_level_values("method")[tolerances >= CURVE_POINTS])


def cells_of_curves(results: Results) -> pd.DataFrame:
    """The cells that were run, with errors; none if no method has a curve."""
    cells = results.cells[~results.cells["status"].isin(NOT_RUN)]
    return with_errors(cells) if curves(cells) else with_errors(cells.iloc[:0])


def pareto(points: pd.DataFrame) -> pd.DataFrame:
    """The points that no other beats in both `error` and `load_case_s`, by increasing error."""
    ordered = points.sort_values(["error", "load_case_s"])
    return ordered[ordered["load_case_s"] < ordered["load_case_s"].cummin().shift(fill_value=math.inf)]


def accurate(cells: pd.DataFrame, accuracy_mm: float) -> pd.Series[bool]:
    """Where the error is at most accuracy_mm, and the reference accurate enough to say so."""
    cells = with_errors(cells)
    unknown = cells["reference_bound_mm"] > BOUND_SHARE * accuracy_mm
    return (cells["error"] <= accuracy_mm) & ~unknown


def can_judge(cells: pd.DataFrame, accuracy_mm: float) -> bool:
    """Whether the references of some cells are accurate enough to decide that an error is ≤ accuracy_mm."""
    return not cells["reference_bound_mm"].max() > BOUND_SHARE * accuracy_mm


def geometric_mean(values: pd.Series[float]) -> float:
    """Missing if one of the values is."""
    return float(math.exp(values.map(math.log).mean(skipna=False)))


def best_tolerances(cells: pd.DataFrame) -> pd.DataFrame:
    """One cell per method and scene: the tolerance that is fastest within the limit, else least wrong."""
    missed = cells["verdict"] != "within"
    error = cells["displacement_error_mm"].where(missed, 0.0)
    order = cells.assign(missed=missed, error=error).sort_values(
        ["missed", "error", "load_case_s"], kind="stable"
    )
    return cells.loc[order.drop_duplicates(["method", "scene"]).index.sort_values()]


def shown(cells: pd.DataFrame, without: Collection[str] = NOT_RUN) -> pd.DataFrame:
    """The cells that a chart shows, without some statuses; none if fewer than two methods are left."""
    cells = cells[~cells["status"].isin(without)]
    often = cells.groupby("method")["scene"].nunique() >= SHOWN * cells["scene"].nunique()
    return cells[cells["method"].map(often).astype(bool)] if often.sum() > 1 else cells.iloc[:0]


def standings(cells: pd.DataFrame) -> pd.DataFrame:
    """One line per method with the best of its tolerances, the best method first: by the share of scenes
    within the limit, then by time relative to the fastest on the scenes it answered.

    load_case_s_<n> : the geometric mean at size n, of the methods within the limit on every scene of it.
    shifted_mean_s : the shifted geometric mean of `total_s`, exp(mean log(t + s)) − s, s = SHIFT_S, of the
    methods measured on every scene; one that is not within the limit counts with the largest time limit on
    its scene.
    """
    cells = cells[cells["status"] != "unsupported"]
    limits = cells.groupby("scene")["time_limit_s"].transform("max")
    cells = best_tolerances(cells.assign(time_limit_s=limits))
    if cells.empty:
        return cells
    good = cells[cells["verdict"] == "within"]
    slower = good["load_case_s"] / good.groupby("scene")["load_case_s"].transform("min")
    lines = []
    for method in in_order(cells, "method"):
        mine = cells[cells["method"] == method]
        counts, missed = mine["verdict"].value_counts(), mine.loc[mine["verdict"] == "no_answer", "status"]
        claimed = (mine["verdict"] == "outside") & (mine["status"] == "solved")
        line: dict[str, Any] = {"method": method, "scenes": len(mine), "within": int(counts.get("within", 0))}
        line |= {"outside": int(counts.get("outside", 0)), "outside_claimed": int(claimed.sum())}
        line |= {"cannot_be_judged": int(counts.get("cannot_be_judged", 0)), "no_answer": len(missed)}
        because = [f"{count} {status.replace('_', ' ')}" for status, count in Counter(missed).most_common()]
        line["no_answer_because"] = ", ".join(because)
        times = slower[good["method"] == method].dropna()
        line["slower"] = geometric_mean(times) if len(times) else np.inf
        spent = mine["total_s"].where(mine["verdict"] == "within", mine["time_limit_s"])
        everywhere = len(mine) == cells["scene"].nunique()
        line["shifted_mean_s"] = geometric_mean(spent + SHIFT_S) - SHIFT_S if everywhere else np.nan
        line |= {"share": line["within"] / len(mine), "worst_error_mm": mine["displacement_error_mm"].max()}
        lines.append(line | {"peak_rss_mib": mine["peak_rss_mib"].max()})
    table = pd.DataFrame(lines)
    for n, of_size in cells.groupby("n"):
        means = fastest_first(of_size, "method").set_index("method")["seconds"]
        table[f"load_case_s_{n:.0f}"] = table["method"].map(means)
    order = {"share": False, "within": False, "slower": True, "no_answer": True, "worst_error_mm": True}
    return table.sort_values([*order], ascending=[*order.values()], kind="stable", ignore_index=True)


def fastest_first(
    cells: pd.DataFrame, name: str = "label", seconds: str = "load_case_s", accuracy_mm: float | None = None
) -> pd.DataFrame:
    """Solver, form and `seconds` of each `name` that is good on every scene of `cells`, by the rule above.
    accuracy_mm : None: the limit.
    """
    good = cells["verdict"] == "within" if accuracy_mm is None else accurate(cells, accuracy_mm)
    scenes = cells["scene"].nunique()
    cells = cells[good & (cells[seconds] > 0)]
    cells = cells[cells.groupby(name)["scene"].transform("nunique") == scenes]
    means = cells.groupby([name, "scene"])[seconds].min().groupby(level=0).agg(geometric_mean)
    lines = cells.drop_duplicates(name).set_index(name, drop=False)[[name, "solver", "form", "owner"]]
    return lines.assign(seconds=means).sort_values("seconds", ignore_index=True)


def recommended(
    cells: pd.DataFrame, accuracy_mm: float | None = None, seconds: str = "load_case_s"
) -> dict[str, Any]:
    """The advice for the scenes of one size: `use` and its `seconds`; `next`, the fastest other method,
    `textbook`, the fastest textbook method, and `library`, the fastest library, each with how
    many times as long it takes.
    """
    line = {"n": cells["n"].iloc[0], "scenes": cells["scene"].nunique(), "accuracy_mm": accuracy_mm}
    line |= {"use": "none on every scene", "seconds": None, "next": "", "textbook": "", "library": ""}
    line |= {"to_next": None, "to_textbook": None, "to_library": None}
    if accuracy_mm is not None and not can_judge(cells, accuracy_mm):
        return line | {"use": "cannot be judged: the reference is not accurate enough"}
    lines = fastest_first(cells, "label", seconds, accuracy_mm)
    if lines.empty:
        return line
    best = lines.iloc[0]
    others = (lines[["solver", "form"]] != best[["solver", "form"]]).any(axis=1)
    line |= {"use": best["label"], "seconds": best["seconds"]}
    opponents = {name: lines["owner"] == name for name in ("textbook", "library")}
    for name, among in {"next": others, **opponents}.items():
        if among.any():
            other = lines[among].iloc[0]
            line |= {name: other["label"], f"to_{name}": other["seconds"] / best["seconds"]}
    return line


def seconds_text(cell: Mapping[str, Any]) -> str:
    """The seconds per load case, or why there is no answer within the limit."""
    if cell["verdict"] == "within":
        return significant(cell["load_case_s"])
    if cell["status"] == "time_limit" and cell["time_limit_s"] > 0:
        return f"> {cell['time_limit_s']:g}"
    if cell["verdict"] in ANSWERED:
        return f"{significant(cell['load_case_s'])} ({str(cell['verdict']).replace('_', ' ')})"
    return str(cell["status"]).replace("_", " ") or MISSING


def of_fastest(owner: str, rows: pd.DataFrame, *names: str) -> pd.Series[float]:
    """The seconds of the fastest solver of that owner, for each row: on its scene, with as many threads, the
    least of the medians of any of the names. A solver counts if all its answers there are within the limit.
    """
    rows = rows.assign(within=rows["verdict"] == "within")
    groups = rows[rows["owner"] == owner].groupby(CELL, dropna=False)
    medians = groups[[*names]].median().min(axis=1).where(groups["within"].all())
    return rows.join(medians.groupby(ROUND).min().rename("fastest"), on=ROUND)["fastest"]


def spreads(rows: pd.DataFrame, by: list[str], names: list[str]) -> pd.DataFrame:
    """The medians over the groups, and with the endings _least and _most the ranges."""
    figures = rows.groupby(by, dropna=False)[names].agg(["median", "min", "max"])
    return figures.set_axis([f"{name}{end}" for name in names for end in ("", "_least", "_most")], axis=1)
