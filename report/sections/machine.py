"""The machine, the code, the method of measurement, and what the columns mean."""

from __future__ import annotations

from typing import Any

import pandas as pd

from report.analysis.code import commits_text
from report.document.blocks import Block, Place, Section, Table, Text, word
from report.document.numbers import listed, tidy_power
from report.results.labels import in_order
from report.results.reader import Results

PLACE = Place(900, "all")

FORMS = {
    "primal": "*Primal*: min ½xᵀKx − fᵀx, Aᵀx ≤ g, in the displacements x of the junction.",
    "dual": "*Dual*: min ½λᵀQλ − pᵀλ, λ ≥ 0, in the contact forces λ, with Q = AᵀK⁻¹A, p = AᵀK⁻¹f − g, "
    "x = K⁻¹(f − Aλ).",
    "sparse": "*Sparse*: min ½ûᵀK̂û − f̂ᵀû, Bᵀû ≤ g, in all unknowns û of the finite-element model, "
    "without condensation.",
}
MEANING = """\
- **error**: max |x − x*| in mm, x* the reference answer, computed from the saved answer.
- **verdict**: the judge's, from the error alone. *Within* or *outside* the limit; *cannot be judged* if the
  reference error bound is too large; *no answer* if there is none.
- **status**: what the solver reported (solved, inaccurate, iteration limit, failed), or what ended the run
  (time limit, memory limit, crashed). *Unsupported*: the solver does not take this form. *Not run*: predicted
  to exceed the time limit, so not started.
- **contact mismatches**: contacts closed in the answer and open in the reference, or vice versa.
- **iterations (inner)**: outer iterations, for an active-set method changes of the active set; in brackets
  inner ones, such as conjugate-gradient iterations.
- **convert**, **prepare**: once per assembly: data into the solver's format; factorisations.
- **set-up**, **solve**: once per load case.
- **form**: what the form costs per load case in addition to the solver: its load vector before the solve
  (p of the dual), and the displacements x after it.
- **time per load case**: set-up + solve + form. **Total**: that, convert and prepare.
- **peak**: the largest resident memory of the measuring process, including mapped data."""


def section(results: Results) -> Section | None:
    if results.rows.empty:
        return None
    blocks: list[Block] = [
        _machine(results),
        _versions(results.rows),
        Text("### Method\n\n" + _method(results)),
        Text("### What the columns mean\n\n" + _forms(results.rows) + MEANING),
        Text(
            "### Reproduce this run\n\nFrom the directory that holds `measurements.jsonl`:\n\n"
            "```\npython -m harness run suite.toml --out again\n```"
        ),
    ]
    return Section("Machine and method", blocks)


def _forms(rows: pd.DataFrame) -> str:
    words = " ".join(text for form, text in FORMS.items() if (rows["form"] == form).any())
    return f"- **solver (form)**: what was run. {words}\n"


def _machine(results: Results) -> Table:
    rows = results.rows
    facts = {"machine": rows["machine"].iloc[0]} | _flat(results.machines.get(rows["machine"].iloc[0], {}))
    facts |= {
        "threads in effect": _values(rows["threads"]),
        "BLAS kernels in effect": _values(rows["kernels"]),
        "rivetbench": _values(rows["rivetbench_version"]),
        "commit": commits_text(rows),
        "measured": _period(rows["recorded_at"]),
    }
    table = pd.DataFrame([{"what": k, "value": v} for k, v in facts.items() if v])
    return Table("machine", "*The machine.*", table, [word("what", "what"), word("value", "value")])


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


def _period(times: pd.Series[Any]) -> str:
    known = sorted(t for t in times if t)
    return f"{known[0]} to {known[-1]}" if known else ""


def _versions(rows: pd.DataFrame) -> Table:
    found = rows.groupby("solver")[["solver_version", "solver_code"]].agg(_values)
    found = found.reindex(in_order(rows, "solver")).reset_index()
    columns = [word("solver", "solver"), word("version", "solver_version"), word("code", "solver_code")]
    caption = "*The solvers.* Code: a fingerprint of the project's code that implements or calls the solver."
    return Table("versions", caption, found, columns)


def _method(results: Results) -> str:
    rows = results.rows
    limits = [
        f"{_values(rows[name])} {unit}"
        for name, unit in (("time_limit_s", "s"), ("memory_limit_mib", "MiB"))
        if rows[name].notna().any()
    ]
    stopped = f" It is terminated at its limits ({', '.join(limits)})." if limits else ""
    asked = [tidy_power(t) for t in sorted(rows["tolerance"].dropna().unique())]
    tolerances = f" The requested tolerances are {listed(asked)}." if asked else ""
    return (
        "Each measurement runs in its own process; thread counts are set before numpy is loaded, and the "
        f"clock starts after the imports.{stopped}{tolerances} Solvers interpret a tolerance differently, so "
        "compare them by the error they achieve. An answer counts if it is within "
        f"{results.limit} of the reference, whatever the solver reports."
    )
