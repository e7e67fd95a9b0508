"""The problems: their size, their conditioning, and the reference error bound."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from report.document.blocks import Column, Section, Table, number, word
from report.document.contents import scene_anchor
from report.document.numbers import as_number, power, significant, whole
from report.results.reader import Results

NUMBERS = ("n", "m", "active", "cond_K", "reference_bound_mm", "build_s")
#: Of the scene's row under `sparse`: the facts of the sparse form.
SPARSE = ("unknowns", "reference_bound_mm", "from_condensed_mm")


def section(results: Results) -> Section | None:
    if results.problems.empty or "scene" not in results.problems:
        return None
    table = results.problems.drop_duplicates("scene", keep="last")
    table = table[table["scene"].isin(results.rows["scene"])]
    if table.empty:
        return None
    table = table.reindex(columns=["scene", "title", *NUMBERS, "reference_route", "sparse"])
    table["build_s"] = table["build_s"].map(lambda s: sum(s.values()) if isinstance(s, dict) else s)
    table = table.assign(**{name: table[name].map(as_number).astype(float) for name in NUMBERS})
    for name in SPARSE:
        own = table["sparse"].map(lambda facts, key=name: facts.get(key) if isinstance(facts, dict) else None)
        table[f"sparse_{name}"] = own.map(as_number).astype(float)
    table = table.drop(columns="sparse").sort_values(["n", "active", "scene"])
    columns = [
        Column("scene", lambda row: f"[{row['scene']}](#{scene_anchor(row['scene'])})", "left"),
        word("title", "title"),
        Column("n, m", lambda row: f"{whole(row['n'])}, {whole(row['m'])}"),
        Column("active (% of m)", _active),
        number("cond(K)", "cond_K", significant),
        number("build, s", "build_s"),
        number("reference error bound, mm", "reference_bound_mm", power),
    ]
    caption = "*The scenes*, each with a link to its table. Active: contacts closed in the reference answer."
    if table["sparse_unknowns"].notna().any():
        columns += [
            number("unknowns of the sparse form", "sparse_unknowns", whole),
            number("its reference error bound, mm", "sparse_reference_bound_mm", power),
            number("difference of the two references, mm", "sparse_from_condensed_mm", power),
        ]
        caption += " The difference of the two references includes the rounding errors of condensation."
    return Section("Problems", [Table("scenes", caption, table, columns)])


def _active(row: Mapping[str, Any]) -> str:
    share = as_number(row["active"] / row["m"]) if row["m"] else None
    return whole(row["active"]) + ("" if share is None else f" ({100 * share:.1f} %)")
