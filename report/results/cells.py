"""The repeats of a measurement, merged so that nothing looks better than it was."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from harness.results.schema import ANSWERED, STEPS, VERDICTS

from .labels import named
from .rows import CELL

MEDIANS = [*STEPS, "model_s", "iterations", "inner_iterations"]
MEDIANS += ["solver_reported_s", "cholesky_s", "product_s"]
LARGEST = ["displacement_error_mm", "reference_bound_mm", "contact_mismatch", "peak_rss_mib", "working_mib"]


def cells_of(rows: pd.DataFrame, by: Sequence[str] = CELL) -> pd.DataFrame:
    """One line per scene, solver, form, variant, tolerance and number of threads, or of what else is given.

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
