"""Rows as a data frame, and cells: their repeats merged, named in as few words as distinguish them.

Of repeats, nothing looks better than it was.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from harness.results.counted_rows import chosen
from harness.results.schema import ANSWERED, FORMS, OWNERS, STEPS, VERDICTS, fields_of_kind
from report.document.numbers import counted, tidy_power

NUMBERS, TEXTS, FLAGS = fields_of_kind("number"), fields_of_kind("text"), fields_of_kind("flag")
#: What distinguishes the measurements of a run, apart from repeats and the cases of a series.
CELL = ["machine", "scene", "solver", "form", "variant", "settings", "batched_asked"]
CELL += ["tolerance", "threads_asked", "round"]
VERSION = ["solver_version", "solver_code"]
MEDIANS = [*STEPS, "model_s", "iterations", "inner_iterations"]
MEDIANS += ["solver_reported_s", "cholesky_s", "product_s"]
LARGEST = ["displacement_error_mm", "reference_bound_mm", "contact_mismatch", "peak_rss_mib", "working_mib"]


def frame(records: list[dict[str, Any]], by: Sequence[str] = ()) -> pd.DataFrame:
    """The rows with every field of the schema as a column of one type, the last of equal measurements.

    by : columns in which equal measurements do not differ, beside those of a cell.

    Flags are 1.0, 0.0 or missing; a null bound beside an error is infinite. Adds `settings`, the options as
    text, and `working_mib`, the memory that the solver needs on top of the data.
    """
    rows = pd.DataFrame(records)
    columns: dict[str, Any] = dict(rows)
    columns["settings"] = rows["options"].map(_settings) if "options" in rows else ""
    for name in [*NUMBERS, *FLAGS]:
        columns[name] = pd.to_numeric(rows[name], errors="coerce").astype(float) if name in rows else np.nan
    for name in TEXTS:
        columns[name] = rows[name].map(lambda v: "" if pd.isna(v) else str(v)) if name in rows else ""
    rows = pd.DataFrame(columns, index=rows.index)
    rows["threads_asked"] = rows["threads_asked"].fillna(rows["threads"])
    unproven = rows["reference_bound_mm"].isna() & rows["displacement_error_mm"].notna()
    rows["reference_bound_mm"] = rows["reference_bound_mm"].mask(unproven, np.inf)
    rows["working_mib"] = rows["peak_rss_mib"] - rows["data_mib"]
    rows = rows.drop_duplicates([*CELL, "repeat", "case", *by], keep="last")
    line = [name for name in (*CELL, "case", *by) if name not in ("machine", "tolerance")]
    return rows[chosen(rows, line)].reset_index(drop=True)


def _settings(options: object) -> str:
    """'rho = 0.1, scaling = 0'."""
    values = options if isinstance(options, dict) else {}
    texts = {name: json.dumps(value, ensure_ascii=False, sort_keys=True) for name, value in values.items()}
    return ", ".join(f"{name} = {text}" for name, text in sorted(texts.items()))


def cells_of(rows: pd.DataFrame, by: Sequence[str] = CELL) -> pd.DataFrame:
    """One line per scene, solver, form, variant, tolerance and so on (CELL), or of what else is given.

    Of the repeats: the worst verdict with its status, the largest error and memory, and the median of each
    time over those that have it. Adds, in seconds,

        load_case_s        set-up + solve + form: the time per load case, its median over the repeats
        least_s, most_s    the least and the largest of it
        once_s             convert + prepare: paid once per assembly
        total_s            load_case_s + once_s

    and `repeats`, their number; `label`, the name of the line; and `method`, that name without the
    tolerance.
    """
    timed = rows["verdict"].isin(ANSWERED) & rows["solve_s"].notna()
    rows = rows.assign(load_case_s=rows[["setup_s", "solve_s", "form_s"]].sum(axis=1).where(timed))
    cell = rows.groupby([*by], dropna=False, sort=False).ngroup()
    severity = rows["verdict"].map({verdict: i for i, verdict in enumerate(VERDICTS)}).fillna(len(VERDICTS))
    ranked = rows.assign(cell=cell, severity=severity).sort_values("severity", ascending=False, kind="stable")
    cells = ranked.drop_duplicates("cell").set_index("cell").sort_index().drop(columns="severity")
    repeats = rows.groupby(cell)
    cells[MEDIANS] = repeats[MEDIANS].median()
    cells[LARGEST] = repeats[LARGEST].max()
    cells["repeats"] = repeats.size()
    cells["verdict"] = cells["verdict"].where(cells["verdict"].isin(VERDICTS), "no_answer")
    answered = cells["verdict"].isin(ANSWERED) & cells["solve_s"].notna()
    for name, figure in (("load_case_s", "median"), ("least_s", "min"), ("most_s", "max")):
        cells[name] = repeats["load_case_s"].agg(figure).where(answered)
    cells["once_s"] = cells[["convert_s", "prepare_s"]].sum(axis=1).where(answered)
    cells["total_s"] = cells["load_case_s"] + cells["once_s"]
    return named(cells)


def named(cells: pd.DataFrame) -> pd.DataFrame:
    """Cells with `method`, 'solver (form)' with the variant if it has one, and the options and the number of
    threads if there are several; `label`, the same with the tolerance if several were asked for.

    The load cases solved at once are named where there are several such numbers on one scene.
    """
    line, batched = [cells[name] for name in ("solver", "form", "variant")], cells["batched_asked"]
    several = cells.groupby(line)[["settings", "threads_asked", "tolerance"]].transform("nunique") > 1
    on_one_scene = batched.fillna(0).groupby([*line, cells["scene"]]).transform("nunique") > 1
    at_once = on_one_scene.groupby(line).transform("any") & batched.notna()
    words = [
        cells["variant"],
        cells["settings"].where(several["settings"], ""),
        batched.map("{:.0f} at once".format).where(at_once, ""),
        cells["threads_asked"].map(_threads).where(several["threads_asked"], ""),
        cells["tolerance"].map(tidy_power).where(several["tolerance"] & (cells["searched"] != 1.0), ""),
    ]
    *words, tolerance = [(" " + word.astype(str)).where(word != "", "") for word in words]
    method = sum(words, cells["solver"] + " (" + cells["form"] + ")")
    return cells.assign(method=method, label=method + tolerance)


def _threads(number: float) -> str:
    return f"× {counted(int(number), 'thread')}" if np.isfinite(number) else ""


def in_order(cells: pd.DataFrame, name: str = "label") -> list[str]:
    """The values of a column (label, method, solver) in the order of all tables: owner, solver, form."""
    lines = cells.drop_duplicates(name)
    owner, form = lines["owner"].map(lambda owner: _place(owner, OWNERS)), lines["form"].map(form_place)
    places = zip(owner, lines["solver"], form, lines[name].astype(str), strict=True)
    return [label for *_, label in sorted(places)]


def form_place(form: str) -> int:
    """The place of a form in the order of FORMS; a form not named there comes last."""
    return _place(form, FORMS)


def _place(name: str, names: Sequence[str]) -> int:
    return names.index(name) if name in names else len(names)


def rung_of(scene: str) -> tuple[str, str]:
    """The ladder and the rung of hard/<ladder>/<rung>, or of another prefix; "" for what a name lacks."""
    _, ladder, rung = [*scene.split("/", 2), "", ""][:3]
    return ladder, rung
