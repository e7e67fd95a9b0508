"""The rungs themselves, times, the measurements without a correct answer, and what the model rejects."""

from __future__ import annotations

import pandas as pd

from harness.results.schema import LADDERS
from report.analysis.outcomes import with_outcomes
from report.analysis.seconds import seconds_text
from report.document.blocks import Block, Place, Section, Table, number, word
from report.document.numbers import as_number, power, whole
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(20, "ladders")

LARGE = 1000  # unknowns, from which the times are worth a table

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
    if len(large := results.cells[results.cells["n"] >= LARGE]):
        blocks.append(_seconds(large))
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
    ]
    caption = (
        "*The measured rungs.* Where the bound is 0, K, f and g were made from a chosen answer without "
        "rounding, so the reference is exact; otherwise it is proven with the reference."
    )
    return Table("rungs", caption, table, columns)


def _seconds(cells: pd.DataFrame) -> Table:
    """A line per rung in the order of measurement, a column per solver."""
    texts = cells.assign(text=[seconds_text(dict(cell)) for _, cell in cells.iterrows()])
    labels = in_order(cells)
    table = texts.pivot_table(index="scene", columns="label", values="text", aggfunc="first", sort=False)
    columns = [word("rung", "scene"), *(word(label, label) for label in labels)]
    caption = "*Seconds per load case* (set-up + solve + form), on the rungs of full size."
    return Table("rungs-seconds", caption, table[labels].reset_index(), columns)


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
