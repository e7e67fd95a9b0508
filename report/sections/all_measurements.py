"""Every measurement, a table per scene; the machine, the code, the method, and the meaning of the columns."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any
from urllib.parse import urlencode

import pandas as pd

from harness.results.schema import VERDICTS
from report.analysis.checks import commits_text
from report.document.blocks import Block, Column, Section, Table, Text, facts_table, number, records, word
from report.document.escape import file_name, plain
from report.document.numbers import MISSING, as_number, counted, listed, power, significant, tidy_power, whole
from report.results.reader import Results
from report.results.rows import in_order

FIGURES = [
    *("scene", "n", "m", "active", "solver", "form", "variant", "tolerance", "threads", "repeats"),
    *("status", "verdict", "iterations", "inner_iterations", "convert_s", "prepare_s", "setup_s", "solve_s"),
    *("form_s", "load_case_s", "least_s", "most_s", "once_s", "total_s", "solver_reported_s"),
    *("displacement_error_mm", "limit_mm", "reference_bound_mm", "contact_mismatch", "min_gap_mm"),
    *("primal_residual", "dual_residual", "duality_gap", "peak_rss_mib", "time_limit_s"),
    *("memory_limit_mib", "message", "device", "log"),
]
MARKS = {"within": "✓ within", "outside": "✗ outside", "cannot_be_judged": "? cannot be judged"}


def section(results: Results) -> Section:
    facts = {problem.get("scene"): problem for problem in records(results.problems)}
    machine = plain(results.rows["machine"].iloc[0]) if results.one_of_several else ""
    blocks: list[Block] = []
    for n, of_size in results.cells.sort_values(["active", "scene"]).groupby("n"):
        blocks.append(Text(f"### n = {n:.0f}"))
        scenes = of_size.groupby("scene", sort=False)
        blocks += [_table(str(scene), cells, facts.get(scene, {}), machine) for scene, cells in scenes]
    return Section("Every solver on every scene", blocks)


def _table(scene: str, cells: pd.DataFrame, problem: Mapping[str, Any], machine: str) -> Table:
    """problem : the row of the scene in problems.jsonl, if there is one. machine : "" if there is one."""
    rank = cells["verdict"].map(VERDICTS.index) + (cells["status"] == "unsupported")
    ordered = cells.assign(rank=rank).sort_values(["rank", "total_s", "solver", "form"], kind="stable")
    columns = [
        word("solver (form)", "label"),
        Column("verdict", partial(_verdict, machine=machine), "left"),
        Column("status (log)", _status, "left"),
        number("error, mm", "displacement_error_mm", power),
        Column("iterations (inner)", _iterations),
        number("per load case, s", "load_case_s"),
        Column("total, s", _total),
        Column("peak, MiB", _peak),
    ]
    active, m = cells["active"].max(), cells["m"].max()
    share = f" ({100 * active / m:.0f} % of {m:.0f})" if active == active and m > 0 else ""
    facts = [str(problem.get("title") or "")]
    facts += [counted(int(active), "active contact") + share] if active == active else []
    facts += [f"cond(K) = {power(problem['cond_K'])}"] if as_number(problem.get("cond_K")) else []
    title = f"**Scene {scene}**: {', '.join(filter(None, facts))}"
    return Table(f"scene-{file_name(scene)}", title, ordered[["label", *FIGURES, "key"]], columns)


def _verdict(row: Mapping[str, Any], machine: str) -> str:
    """A link to the row on the page; machine : where several have a row of one key."""
    mark, named = MARKS.get(row["verdict"], MISSING), {"machine": machine} if machine else {}
    return f"[{mark}](index.html#{urlencode({'row': plain(row['key'])} | named)})" if row["key"] else mark


def _status(row: Mapping[str, Any]) -> str:
    status = str(row["status"]).replace("_", " ")
    return f"[{status}](../{row['log']})" if row["log"] else status


def _iterations(row: Mapping[str, Any]) -> str:
    inner = whole(row["inner_iterations"])
    return whole(row["iterations"]) + (f" ({inner})" if inner != MISSING else "")


def _total(row: Mapping[str, Any]) -> str:
    """The seconds, or the time limit of a run that was stopped by it."""
    if row["verdict"] != "within" and row["status"] == "time_limit" and row["time_limit_s"] > 0:
        return f"> {row['time_limit_s']:g} s (time limit)"
    return significant(row["total_s"])


def _peak(row: Mapping[str, Any]) -> str:
    if row["status"] == "memory_limit" and row["memory_limit_mib"] > 0:
        return f"> {whole(row['memory_limit_mib'])}"
    return whole(row["peak_rss_mib"])


MEANING = """\
Each measurement runs in its own process; the clock starts after the imports.

- **form**: *primal*, min ½xᵀKx − fᵀx, Aᵀx ≤ g; *dual*, min ½λᵀQλ − pᵀλ, λ ≥ 0, with Q = AᵀK⁻¹A, p = AᵀK⁻¹f −
  g, x = K⁻¹(f − Aλ); *sparse*, the primal in all unknowns of the finite-element model.
- **error**: max |x − x*| in mm, x* the reference answer.
- **verdict**: the judge's, from the error alone; *cannot be judged* if the reference's error bound is large.
- **status**: what the solver reported, or what ended the run; a link leads to what it printed.
- **iterations (inner)**: for an active-set method changes of the active set.
- **convert**, **prepare**: once per assembly. **Set-up**, **solve**, **form** (p and x of the dual): once per
  load case, its time their sum. **Total**: that, convert and prepare.
- **peak**: the largest resident memory of the measuring process, including mapped data.

To reproduce: `python -m harness run suite.toml --out again`, in the directory of `measurements.jsonl`."""


def machine(results: Results) -> Section:
    rows = results.rows
    facts = {"machine": rows["machine"].iloc[0]} | _flat(results.machines.get(rows["machine"].iloc[0], {}))
    times = sorted(time for time in rows["recorded_at"] if time)
    facts |= {
        "device": _values(rows["device"]),
        "threads in effect": _values(rows["threads"]),
        "BLAS kernels in effect": _values(rows["kernels"]),
        "time limit, s": _values(rows["time_limit_s"]),
        "memory limit, MiB": _values(rows["memory_limit_mib"]),
        "tolerances": ", ".join(tidy_power(value) for value in sorted(rows["tolerance"].dropna().unique())),
        "rivetbench": _values(rows["rivetbench_version"]),
        "commit": commits_text(rows),
        "measured": f"{times[0]} to {times[-1]}" if times else "",
    }
    solvers = rows.groupby("solver")[["solver_version", "solver_code"]].agg(_values)
    solvers = solvers.reindex(in_order(rows, "solver")).reset_index()
    columns = [word("solver", "solver"), word("version", "solver_version"), word("code", "solver_code")]
    blocks: list[Block] = [
        facts_table("machine", "*The machine.*", facts),
        Table("versions", "*The solvers*, with a fingerprint of the code that calls them.", solvers, columns),
        Text(MEANING),
    ]
    return Section("Machine and method", blocks)


def _flat(facts: dict[str, Any], above: str = "") -> dict[str, str]:
    """Nested facts as 'outer, inner': value."""
    flat: dict[str, str] = {}
    for key, value in facts.items():
        name = (f"{above}, {key}" if above else key).replace("_", " ")
        if isinstance(value, dict):
            flat |= _flat(value, name)
        elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
            flat |= _flat({f"{key} {i}": item for i, item in enumerate(value, start=1)}, above)
        elif value is not None:
            flat[name] = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    return flat


def _values(column: pd.Series[Any]) -> str:
    """The distinct values of a column as text."""
    values = [v for v in column.dropna().unique() if v != ""]
    return listed([f"{v:.10g}" if isinstance(v, float) else str(v) for v in values]) if values else ""
