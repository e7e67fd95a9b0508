"""Table 4: the test problems."""

from __future__ import annotations

from report.document.blocks import Section

from .lines import table
from .printed import TABLE_4
from .rows import SCALING, Row, Study


def section(study: Study) -> Section:
    ours = {p["n"]: p for p in study.problems if not p["scene"].startswith(SCALING)}
    lines: list[Row] = []
    for problem, n, m, cond in TABLE_4:
        here = ours.get(n, {})
        found = here.get("cond_K")
        line = {"problem": problem, "n": here.get("n"), "n, printed": n, "m": here.get("m"), "m, printed": m}
        line |= {"cond(K)": found, "cond(K), printed": cond}
        lines.append(line | {"difference": f"{found / cond - 1:+.2%}" if found else None})
    about = "*The test problems.* Ours are plate models of our own with the paper's nodes and constraints."
    return Section("Table 4: test problems", [table("table4", about, lines)])
