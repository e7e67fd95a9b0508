"""The problems: their size, their conditioning, and the reference error bound."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from report.document.blocks import Block, Column, Place, Section, Table, number, word
from report.document.contents import scene_anchor
from report.document.numbers import as_number, power, whole
from report.results.reader import Results

PLACE = Place(310)

#: Of the scene's row under `sparse`: the facts of the sparse form.
SPARSE = ("unknowns", "reference_bound_mm", "from_condensed_mm")


def section(results: Results) -> Section | None:
    if results.problems.empty or "scene" not in results.problems:
        return None
    names = ("n", "m", "active", "cond_K", "lambda_min", "lambda_max", "reference_bound_mm")
    table = results.problems.drop_duplicates("scene", keep="last")
    table = table[table["scene"].isin(results.rows["scene"])]
    if table.empty:
        return None
    table = table.reindex(columns=["scene", *names, "build_s", "title", "reference_route", "sparse"])
    for name in SPARSE:
        own = table["sparse"].map(lambda facts, key=name: facts.get(key) if isinstance(facts, dict) else None)
        table[f"sparse_{name}"] = own.map(as_number).astype(float)
    table["build_s"] = table["build_s"].map(lambda s: sum(s.values()) if isinstance(s, dict) else s)
    for name in (*names, "build_s"):
        table[name] = table[name].map(as_number).astype(float)
    table = table.sort_values(["n", "active", "scene"])
    table["active_share"] = table["active"] / table["m"]
    blocks: list[Block] = [_assemblies(table), _scenes(table)]
    return Section("Problems", blocks)


def _assemblies(table: pd.DataFrame) -> Table:
    by_assembly = table.groupby(["n", "m", "cond_K"], as_index=False, dropna=False)
    sizes = by_assembly.agg(scenes=("scene", "count"), build_s=("build_s", "max"))
    columns = [
        number("unknowns n", "n", whole),
        number("contacts m", "m", whole),
        number("scenes", "scenes", whole),
        number("cond(K)", "cond_K"),
        number("build, s", "build_s"),
    ]
    return Table("assemblies", "*The assemblies.*", sizes, columns)


def _scenes(table: pd.DataFrame) -> Table:
    names = ["scene", "title", "n", "m", "active", "active_share", "reference_bound_mm", "reference_route"]
    own = [f"sparse_{name}" for name in SPARSE]
    names += own if (sparse := table["sparse_unknowns"].notna().any()) else []
    columns = [
        Column("scene", _linked, "left"),
        word("title", "title"),
        Column("active (% of m)", _active),
        number("reference error bound, mm", "reference_bound_mm", power),
        word("reference computed by", "reference_route"),
    ]
    caption = (
        "*The scenes*, each with a link to its table. Active: contacts closed in the reference answer. An "
        "answer is judged only if the reference error bound is well below the limit."
    )
    if sparse:
        columns += [
            number("unknowns of the sparse form", own[0], whole),
            number("its reference error bound, mm", own[1], power),
            number("difference of the two references, mm", own[2], power),
        ]
        caption += (
            " The sparse form, with the finite-element model's own unknowns, has a reference of its own; the "
            "difference is the largest between its displacements of the junction and those of the condensed "
            "matrices. It includes the rounding errors of condensation, which neither bound covers."
        )
    return Table("scenes", caption, table[names], columns)


def _linked(row: Mapping[str, Any]) -> str:
    return f"[{row['scene']}](#{scene_anchor(row['scene'])})"


def _active(row: Mapping[str, Any]) -> str:
    share = as_number(row["active_share"])
    return whole(row["active"]) + ("" if share is None else f" ({100 * share:.1f} %)")
