"""The ladders: where each solver breaks, and whether it knows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd

from report.analysis.outcomes import DOUBTED, KNEW, LIED, NONE, RIGHT, UNJUDGED, holds, with_outcomes
from report.document.blocks import Block, Column, Figure, Place, Section, Table, Text, number, word
from report.document.numbers import MISSING, counted, power, whole
from report.figures.ladder_map import ladder_map
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(10, "ladders")

CONDITION = 1e12  # of K: up to it the in-house solvers are to hold


def section(results: Results) -> Section | None:
    if results.cells.empty:
        return None
    cells = with_outcomes(results.cells)
    order = in_order(cells)
    ladders = rungs_in_order(results, cells)
    blocks: list[Block] = [
        Text(
            "A rung is right within max(1e-7 mm, 100 cond(K) 2⁻⁵³ max|x*|): what conditioning leaves to a "
            "solver that works in float64. " + in_house(results, cells)
        ),
        Figure(
            "ladders",
            "*Every solver on every rung; each ladder grows harder to the right.* Dark: right, and called "
            "solved; pale: right, though the solver would not say so; hatched: wrong, and the solver knew; "
            "×: wrong and called solved; –: no answer.",
            ladder_map(cells, order, ladders),
        ),
        honesty(cells, order),
        breaking_points(cells, order, ladders),
    ]
    return Section("Where each solver breaks, and whether it knows", blocks)


def rungs_in_order(results: Results, cells: pd.DataFrame) -> dict[str, list[str]]:
    """The rungs of each ladder, as the suite lists them; what it does not list, as it was measured."""
    listed = [scene for scene in results.suite.get("scenes", []) if scene in set(cells["scene"])]
    ladders: dict[str, list[str]] = {}
    for scene in dict.fromkeys([*listed, *cells["scene"]]):
        _, ladder, rung = scene.split("/")
        ladders.setdefault(ladder, []).append(rung)
    return ladders


def in_house(results: Results, cells: pd.DataFrame) -> str:
    """How the in-house solvers keep what is asked of them."""
    own = cells[cells["in_house"]]
    if own.empty or not {"scene", "cond_K"} <= set(results.problems):
        return ""
    known = results.problems.drop_duplicates("scene", keep="last").set_index("scene")["cond_K"]
    asked = own[own["scene"].map(known) <= CONDITION * (1 + 1e-6)]
    wrong = int((own["outcome"] == LIED).sum())
    return (
        f"The in-house solvers are right in {int(holds(asked).sum())} of {counted(len(asked), 'row')} up to "
        f"cond(K) = 1e12; in all their {counted(len(own), 'row')}, {wrong or 'no'} wrong "
        f"{'answers are' if wrong > 1 else 'answer is'} called solved."
    )


def honesty(cells: pd.DataFrame, order: list[str]) -> Table:
    records = []
    for label in order:
        line = cells[cells["label"] == label]
        share = line["displacement_error_mm"] / line["limit_mm"]
        counts = line["outcome"].value_counts()
        record: dict[str, Any] = {"label": label, "rungs": len(line)}
        record |= {name: int(counts.get(name, 0)) for name in (RIGHT, DOUBTED, KNEW, LIED, NONE, UNJUDGED)}
        solved = line["status"] == "solved"
        record["worst_share"] = share[solved].max()
        record["backward_error"] = line.loc[solved, "backward_error"].median()
        record["where"] = ", ".join(_short(line[line["outcome"] == LIED]))
        records.append(record)
    columns = [word("solver (form)", "label"), number("rungs", "rungs", whole)]
    columns += [number(name, name, whole) for name in (RIGHT, DOUBTED, KNEW, NONE)]
    columns.append(Column("**wrong, called solved**", _bold(LIED)))
    columns += [
        number("largest error / limit of what was called solved", "worst_share", power),
        number("median backward error of it", "backward_error", power),
    ]
    caption = (
        "*Honesty.* A wrong answer that is called solved is the worst that a solver can give. Backward "
        "error: what the answer leaves of the optimality conditions, as a share of the terms in them."
    )
    return Table("honesty", caption, pd.DataFrame(records), columns)


def breaking_points(cells: pd.DataFrame, order: list[str], ladders: dict[str, list[str]]) -> Table:
    records = []
    for label in order:
        line = cells[cells["label"] == label]
        record = {"label": label}
        for ladder, rungs in ladders.items():
            record[ladder] = _first_broken(line[line["ladder"] == ladder], rungs)
        records.append(record)
    columns = [word("solver (form)", "label"), *(word(ladder, ladder) for ladder in ladders)]
    caption = (
        "*Breaking points: the first rung of each ladder without a right answer.* ×: it was called solved. "
        f"{MISSING}: right on every rung."
    )
    return Table("breaking-points", caption, pd.DataFrame(records), columns)


def _first_broken(line: pd.DataFrame, rungs: list[str]) -> str:
    broken = line[~holds(line)].set_index("rung")["outcome"]
    for rung in rungs:
        if rung in broken:
            return f"{rung} ×" if broken[rung] == LIED else rung
    return MISSING


def _short(line: pd.DataFrame) -> list[str]:
    return [scene.split("/", 1)[1] for scene in line["scene"]]


def _bold(name: str) -> Callable[[Mapping[str, Any]], str]:
    return lambda row: f"**{row[name]}**" if row[name] else "0"
