"""The machine, the code, the method of measurement, and what the columns mean."""

from __future__ import annotations

from typing import Any

import pandas as pd

from report.analysis.checks import commits_text
from report.document.blocks import Block, Section, Table, Text, word
from report.document.numbers import listed, tidy_power
from report.results.reader import Results
from report.results.rows import in_order

MEANING = """\
Each measurement runs in its own process; the clock starts after the imports.

- **form**: *primal*, min ½xᵀKx − fᵀx, Aᵀx ≤ g; *dual*, min ½λᵀQλ − pᵀλ, λ ≥ 0, with Q = AᵀK⁻¹A, p = AᵀK⁻¹f −
  g, x = K⁻¹(f − Aλ); *sparse*, the primal in all unknowns of the finite-element model.
- **error**: max |x − x*| in mm, x* the reference answer.
- **verdict**: the judge's, from the error alone; *cannot be judged* if the reference's error bound is large.
- **status**: what the solver reported, or what ended the run.
- **iterations (inner)**: for an active-set method changes of the active set.
- **convert**, **prepare**: once per assembly. **Set-up**, **solve**, **form** (p and x of the dual): once per
  load case, its time their sum. **Total**: that, convert and prepare.
- **peak**: the largest resident memory of the measuring process, including mapped data.

To reproduce: `python -m harness run suite.toml --out again`, in the directory of `measurements.jsonl`."""


def section(results: Results) -> Section | None:
    if results.rows.empty:
        return None
    rows = results.rows
    facts = {"machine": rows["machine"].iloc[0]} | _flat(results.machines.get(rows["machine"].iloc[0], {}))
    times = sorted(time for time in rows["recorded_at"] if time)
    facts |= {
        "threads in effect": _values(rows["threads"]),
        "BLAS kernels in effect": _values(rows["kernels"]),
        "time limit, s": _values(rows["time_limit_s"]),
        "memory limit, MiB": _values(rows["memory_limit_mib"]),
        "tolerances": ", ".join(tidy_power(value) for value in sorted(rows["tolerance"].dropna().unique())),
        "rivetbench": _values(rows["rivetbench_version"]),
        "commit": commits_text(rows),
        "measured": f"{times[0]} to {times[-1]}" if times else "",
    }
    known = pd.DataFrame([{"what": name, "value": value} for name, value in facts.items() if value])
    found = rows.groupby("solver")[["solver_version", "solver_code"]].agg(_values)
    found = found.reindex(in_order(rows, "solver")).reset_index()
    columns = [word("solver", "solver"), word("version", "solver_version"), word("code", "solver_code")]
    blocks: list[Block] = [
        Table("machine", "*The machine.*", known, [word("what", "what"), word("value", "value")]),
        Table("versions", "*The solvers*, with a fingerprint of the code that calls them.", found, columns),
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
