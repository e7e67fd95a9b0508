"""The ladders: where each solver fails, and whether it reports the failure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd

from report.analysis.outcomes import (
    CORRECT,
    CORRECT_UNCLAIMED,
    NO_ANSWER,
    UNJUDGED,
    WRONG_CLAIMED,
    WRONG_UNCLAIMED,
    is_correct,
    with_outcomes,
)
from report.document.blocks import Block, Column, Figure, Place, Section, Table, Text, number, word
from report.document.numbers import MISSING, counted, listed, power, whole
from report.figures.ladder_map import ladder_map
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(10, "ladders")

NOT_RUN = "not run"
CONDITION = 1e12  # of K: up to it the in-house solvers are required to be correct


def section(results: Results) -> Section | None:
    if results.cells.empty:
        return None
    cells = with_outcomes(results.cells)
    order = in_order(cells)
    ladders = rungs_in_order(results, cells)
    blocks: list[Block] = [
        Text(f"{in_house(results, cells)} {libraries(cells)}".strip()),
        Figure(
            "ladders",
            "*Every solver on every rung; each ladder grows harder to the right.* Dark: correct and reported "
            "as solved; pale: correct, but not reported as solved; hatched: wrong, and not reported as "
            "solved; red: wrong, but reported as solved; –: no answer; empty: not run. A k in a wrong "
            "answer: its error is up to 10ᵏ times the limit, ∞ beyond 10⁹⁹. A rung whose limit is wider than "
            f"{results.limit} has it below the figure.",
            ladder_map(cells, order, ladders),
        ),
        Text(
            "An answer on a rung is correct if its error is at most max(1e-7 mm, 100 cond(K) 2⁻⁵³ max|x*|): "
            "what conditioning allows a solver that works in float64."
        ),
        honesty(cells, order),
        breaking_points(cells, order, ladders),
    ]
    return Section("Where each solver fails, and whether it reports it", blocks)


def rungs_in_order(results: Results, cells: pd.DataFrame) -> dict[str, list[str]]:
    """The rungs of each ladder in the order of the suite, others in the order of measurement."""
    listed = [scene for scene in results.suite.get("scenes", []) if scene in set(cells["scene"])]
    ladders: dict[str, list[str]] = {}
    for scene in dict.fromkeys([*listed, *cells["scene"]]):
        _, ladder, rung = scene.split("/")
        ladders.setdefault(ladder, []).append(rung)
    return ladders


def in_house(results: Results, cells: pd.DataFrame) -> str:
    """Whether the in-house solvers meet their requirements."""
    own = cells[cells["in_house"]]
    if own.empty or not {"scene", "cond_K"} <= set(results.problems):
        return ""
    known = results.problems.drop_duplicates("scene", keep="last").set_index("scene")["cond_K"]
    asked = own[own["scene"].map(known) <= CONDITION * (1 + 1e-6)]
    wrong = int((own["outcome"] == WRONG_CLAIMED).sum())
    missed = asked.loc[~is_correct(asked), "solver"].value_counts()
    named = [f"{name} ({count})" for name, count in missed.items()]
    others = f", the others being of {listed(named)}" if named else ""
    return (
        f"The in-house solvers are correct in {len(asked) - missed.sum()} of "
        f"{counted(len(asked), 'row')} up to cond(K) = 1e12{others}; "
        f"in all their {counted(len(own), 'row')}, "
        f"{wrong or 'no'} wrong {'answers are' if wrong > 1 else 'answer is'} reported as solved."
    )


def libraries(cells: pd.DataFrame) -> str:
    """How often a library says solved of a wrong answer."""
    others = cells[~cells["in_house"]]
    if others.empty:
        return ""
    wrong = int((others["outcome"] == WRONG_CLAIMED).sum())
    return (
        f"Of {counted(len(others), 'row')} of the libraries, {wrong or 'no'} "
        f"wrong {'answer is' if wrong == 1 else 'answers are'} reported as solved."
    )


def honesty(cells: pd.DataFrame, order: list[str]) -> Table:
    records = []
    for label in order:
        line = cells[cells["label"] == label]
        share = line["displacement_error_mm"] / line["limit_mm"]
        counts = line["outcome"].value_counts()
        record: dict[str, Any] = {"label": label, "rungs": len(line)}
        record |= {
            name: int(counts.get(name, 0))
            for name in (CORRECT, CORRECT_UNCLAIMED, WRONG_UNCLAIMED, WRONG_CLAIMED, NO_ANSWER, UNJUDGED)
        }
        solved = line["status"] == "solved"
        record["worst_share"] = share[solved].max()
        record["backward_error"] = line.loc[solved, "backward_error"].median()
        record["where"] = ", ".join(_short(line[line["outcome"] == WRONG_CLAIMED]))
        records.append(record)
    columns = [word("solver (form)", "label"), number("rungs", "rungs", whole)]
    columns += [
        number(name, name, whole) for name in (CORRECT, CORRECT_UNCLAIMED, WRONG_UNCLAIMED, NO_ANSWER)
    ]
    columns.append(Column("**wrong, reported solved**", _bold(WRONG_CLAIMED)))
    columns += [
        number("largest error / limit, reported solved", "worst_share", power),
    ]
    caption = "*Wrong answers reported as solved* are the worst outcome."
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
        "*Breaking points: the first rung of each ladder without a correct answer.* ×: reported as solved. "
        f"{MISSING}: correct on every rung that was run."
    )
    return Table("breaking-points", caption, pd.DataFrame(records), columns)


def _first_broken(line: pd.DataFrame, rungs: list[str]) -> str:
    if line.empty:
        return NOT_RUN
    broken = line[~is_correct(line)].set_index("rung")["outcome"]
    for rung in rungs:
        if rung in broken:
            return f"{rung} ×" if broken[rung] == WRONG_CLAIMED else rung
    return MISSING


def _short(line: pd.DataFrame) -> list[str]:
    return [scene.split("/", 1)[1] for scene in line["scene"]]


def _bold(name: str) -> Callable[[Mapping[str, Any]], str]:
    return lambda row: f"**{row[name]}**" if row[name] else "0"
