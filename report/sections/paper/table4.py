"""Table 4: the test problems."""

from __future__ import annotations

from typing import Any

import pandas as pd

from report.analysis.paper.selection import SCALING, is_paper
from report.document.blocks import Place, Section, Table, number, records
from report.document.numbers import as_number, signed, whole
from report.results.printed import TABLE_4
from report.results.reader import Results

PLACE = Place(250)


def section(results: Results) -> Section | None:
    if not is_paper(results) or not {"scene", "n", "m", "cond_K"} <= set(results.problems):
        return None
    ours = results.problems[~results.problems["scene"].str.startswith(SCALING)]
    lines = []
    for problem, n, m, cond in TABLE_4:
        here = ours[ours["n"] == n]
        found = as_number(here["cond_K"].iloc[0]) if len(here) else None
        line: dict[str, Any] = {"problem": problem, "n_printed": n, "m_printed": m, "cond_K_printed": cond}
        line |= {"n": None, "m": None} | (records(here[["n", "m"]])[0] if len(here) else {})
        line["cond_K"] = found
        line["difference_percent"] = 100 * (found / cond - 1) if found else None
        lines.append(line)
    columns = [
        number("problem", "problem", whole),
        number("n", "n", whole),
        number("printed", "n_printed", whole),
        number("m", "m", whole),
        number("printed ", "m_printed", whole),
        number("cond(K)", "cond_K"),
        number("printed  ", "cond_K_printed"),
        number("difference, %", "difference_percent", signed),
    ]
    caption = (
        "*The test problems, ours beside Table 4 of the paper.* Ours are plate models of our own with the "
        "paper's numbers of nodes and constraints; cond(K) is printed with three digits."
    )
    return Section("Table 4: test problems", [Table("paper-table4", caption, pd.DataFrame(lines), columns)])
