"""Every measurement: one table per scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from urllib.parse import urlencode

import pandas as pd

from harness.results.schema import VERDICTS
from report.document.blocks import Block, Column, Section, Table, Text, number, records, word
from report.document.escape import file_name, plain
from report.document.numbers import MISSING, as_number, power, significant, whole
from report.results.reader import Results

FIGURES = [
    *("scene", "n", "m", "active", "solver", "form", "variant", "tolerance", "threads", "repeats"),
    *("status", "verdict", "iterations", "inner_iterations", "convert_s", "prepare_s", "setup_s", "solve_s"),
    *("form_s", "load_case_s", "least_s", "most_s", "once_s", "total_s", "solver_reported_s"),
    *("displacement_error_mm", "limit_mm", "reference_bound_mm", "contact_mismatch", "min_gap_mm"),
    *("primal_residual", "dual_residual", "duality_gap", "peak_rss_mib", "time_limit_s"),
    *("memory_limit_mib", "message"),
]
MARKS = {"within": "✓ within", "outside": "✗ outside", "cannot_be_judged": "? cannot be judged"}


def section(results: Results) -> Section | None:
    if results.cells.empty:
        return None
    facts = {problem.get("scene"): problem for problem in records(results.problems)}
    blocks: list[Block] = []
    for n in [*results.sizes, None]:
        of_size = results.cells[results.cells["n"].isna() if n is None else results.cells["n"] == n]
        if len(of_size):
            blocks.append(Text("### Size not recorded" if n is None else f"### n = {n}"))
        ordered = of_size.sort_values(["active", "scene"])
        blocks += [
            _table(str(scene), of, facts.get(scene, {})) for scene, of in ordered.groupby("scene", sort=False)
        ]
    return Section("Every solver on every scene", blocks)


def _table(scene: str, cells: pd.DataFrame, problem: Mapping[str, Any]) -> Table:
    """problem : the row of the scene in problems.jsonl, if there is one."""
    rank = cells["verdict"].map(VERDICTS.index) + (cells["status"] == "unsupported")
    ordered = cells.assign(rank=rank).sort_values(["rank", "total_s", "solver", "form"], kind="stable")
    columns = [
        word("solver (form)", "label"),
        Column("verdict", _verdict, "left"),
        Column("status", lambda row: str(row["status"]).replace("_", " "), "left"),
        number("error, mm", "displacement_error_mm", power),
        Column("iterations (inner)", _iterations),
        number("per load case, s", "load_case_s"),
        Column("total, s", _total),
        Column("peak, MiB", _peak),
    ]
    active, m = cells["active"].max(), cells["m"].max()
    share = f" ({100 * active / m:.0f} % of {m:.0f})" if active == active and m > 0 else ""
    known = [str(problem.get("title") or "")]
    known += [f"{active:.0f} active contacts{share}"] if active == active else []
    known += [f"cond(K) = {power(problem['cond_K'])}"] if as_number(problem.get("cond_K")) else []
    title = f"**Scene {scene}**: {', '.join(filter(None, known))}"
    return Table(f"scene-{file_name(scene)}", title, ordered[["label", *FIGURES, "key"]], columns)


def _verdict(row: Mapping[str, Any]) -> str:
    mark = MARKS.get(row["verdict"], MISSING)
    return f"[{mark}](index.html#{urlencode({'row': plain(row['key'])})})" if row["key"] else mark


def _iterations(row: Mapping[str, Any]) -> str:
    inner = whole(row["inner_iterations"])
    return whole(row["iterations"]) + (f" ({inner})" if inner != MISSING else "")


def _total(row: Mapping[str, Any]) -> str:
    """The seconds, or the time limit of a run that was stopped by it."""
    if row["verdict"] == "no_answer" and row["status"] == "time_limit" and row["time_limit_s"] > 0:
        return f"> {row['time_limit_s']:.4g} s (time limit)"
    return significant(row["total_s"])


def _peak(row: Mapping[str, Any]) -> str:
    if row["status"] == "memory_limit" and row["memory_limit_mib"] > 0:
        return f"> {whole(row['memory_limit_mib'])}"
    return whole(row["peak_rss_mib"])
