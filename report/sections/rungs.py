"""The rungs themselves, the measurements on them without a correct answer, and what the model rejects."""

from __future__ import annotations

import pandas as pd

from harness.results.schema import LADDERS
from report.analysis.outcomes import with_outcomes
from report.document.blocks import Block, Place, Section, Table, number, word
from report.document.numbers import as_number, power, whole
from report.results.reader import Results

PLACE = Place(20, "ladders")

FIGURES = (
    *("label", "scene", "status", "verdict", "outcome", "displacement_error_mm", "limit_mm"),
    *("backward_error", "iterations", "solve_s", "message"),
)


def section(results: Results) -> Section | None:
    if results.cells.empty or "scene" not in results.problems:
        return None
    known = results.problems[results.problems["scene"].str.startswith(LADDERS)]
    known = known.drop_duplicates("scene", keep="last")
    blocks: list[Block] = [_taken(results, known)]
    broken = with_outcomes(results.cells).query("verdict != 'within'")
    if len(broken):
        blocks.append(_broken(broken))
    if "refused" in known and known["refused"].notna().any():
        blocks.append(_refused(known[known["refused"].notna()]))
    return Section("The rungs", blocks)


def _taken(results: Results, known: pd.DataFrame) -> Table:
    limits = results.rows.groupby("scene")["limit_mm"].max()
    table = known[known["scene"].isin(limits.index)].reindex(
        columns=["scene", "title", "n", "m", "active", "cond_K", "reference_bound_mm", "reference_route"]
    )
    for name in ("n", "m", "active", "cond_K", "reference_bound_mm"):
        table[name] = table[name].map(as_number).astype(float)
    table["limit_mm"] = table["scene"].map(limits)
    columns = [
        word("rung", "scene"),
        word("description", "title"),
        number("n", "n", whole),
        number("m", "m", whole),
        number("active", "active", whole),
        number("cond(K)", "cond_K", power),
        number("limit, mm", "limit_mm", power),
        number("reference error bound, mm", "reference_bound_mm", power),
        word("reference computed by", "reference_route"),
    ]
    caption = (
        "*The measured rungs.* Chosen, exact: K, f and g were made from a chosen answer without rounding, so "
        "the reference is exact; otherwise the bound is proven with the reference."
    )
    return Table("rungs", caption, table, columns)


def _broken(cells: pd.DataFrame) -> Table:
    columns = [
        word("rung", "scene"),
        word("solver (form)", "label"),
        word("status", "status"),
        number("error, mm", "displacement_error_mm", power),
        number("limit, mm", "limit_mm", power),
        number("backward error", "backward_error", power),
    ]
    caption = "*Every measurement without a correct answer.*"
    return Table("rungs-broken", caption, cells.sort_values(["scene", "label"])[[*FIGURES]], columns)


def _refused(known: pd.DataFrame) -> Table:
    table = known[["scene", "title", "refused"]].copy()
    table["refused"] = table["refused"].replace("", "**accepted, although the model does not cover it**")
    columns = [word("rung", "scene"), word("description", "title"), word("error message", "refused")]
    caption = "*What the model rejects, as it should*: a clear error rather than a plausible wrong answer."
    return Table("rungs-refused", caption, table, columns)
