"""Table 2: the starting points on the ten loads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd

from harness.results.schema import ANSWERED
from report.analysis.paper.selection import cells_of_paper, figures_of, ipm, is_paper
from report.analysis.paper.starts import RIVALS, STARTS, loads, no_more, scene_of
from report.document.blocks import Column, Place, Section, Table, Text, number, records, word
from report.document.numbers import MISSING, as_number, counted, power, significant, span, tidy_power, whole
from report.results.printed import TABLE_2
from report.results.reader import Results

PLACE = Place(230)


def section(results: Results) -> Section | None:
    if not is_paper(results):
        return None
    cells = cells_of_paper(results)
    lines = loads(cells)
    if not any(line[f"{start}_key"] for line in lines for start in RIVALS):
        return None
    return Section("Table 2: starting points", [_table(lines, cells), Text(_counted(lines)), _starts(cells)])


def _table(lines: list[dict[str, Any]], cells: pd.DataFrame) -> Table:
    columns = [number("active, printed", "active_printed", whole), number("ours", "active", whole)]
    for start, name in STARTS.items():
        columns += [
            Column(f"{name}: iterations", _pair(f"{start}_iterations", whole)),
            Column(f"{name}: s", _pair(f"{start}_s", lambda s: significant(s), f"{start}_text")),
        ]
    mu = sorted(ipm(cells)["tolerance"].dropna().unique())
    caption = (
        "*The starting points on the ten loads, ours | printed.* Ours: interior-point iterations to ε_μ = "
        f"{' / '.join(map(tidy_power, mu))} N·mm (the paper does not state its own) and seconds per load "
        "case; printed: Table 2 of the paper, on its machine. STP1 and STP2 are as read from a secondary "
        "source. Mehrotra's start is not in the paper."
    )
    return Table("paper-table2", caption, pd.DataFrame(lines), columns)


def _pair(name: str, style: Callable[[object], str], words: str = "") -> Callable[[Mapping[str, Any]], str]:
    def text(row: Mapping[str, Any]) -> str:
        ours = row[words] if words else style(row[name])
        printed = style(row[f"{name}_printed"])
        return ours if printed == MISSING else f"{ours} \\| {printed}"

    return text


def _counted(lines: list[dict[str, Any]]) -> str:
    ours = [no_more(line) for line in lines]
    printed = [no_more(line, "_printed") for line in lines]
    known = [o for o in ours if o is not None]
    missing = len(ours) - len(known)
    where = [f"{line['active_printed']}" for line, o in zip(lines, ours, strict=True) if o is False]
    words = (
        f"Algorithm 5 needs no more iterations than STP1 and STP2 on **{sum(known)} of "
        f"{counted(len(known), 'load')}** here"
        + (f" ({missing} without an answer of all three)" if missing else "")
        + f", and on {sum(map(bool, printed))} of {len(printed)} in the printed table."
    )
    words += f" It needs more at {', '.join(where)} active (printed count)." if where else ""
    return " ".join([words, *(_against(rival, lines) for rival in RIVALS)])


def _against(rival: str, lines: list[dict[str, Any]]) -> str:
    """On how many loads Algorithm 5 needs no more than this one, and how far above it starts elsewhere."""
    names = [f"{start}_{what}" for start in ("algorithm_5", rival) for what in ("iterations", "mu")]
    known = pd.DataFrame(lines)[names].apply(pd.to_numeric, errors="coerce").dropna()
    mine, mu, other, least = (known[name] for name in names)
    more, above = (mine - other)[mine > other], (mu / least)[mine > other]
    text = f"Against {STARTS[rival]} alone it needs no more on {len(known) - len(more)} of {len(known)}"
    if more.empty:
        return text + "."
    times = span(significant(above.min(), 2), significant(above.max(), 2))
    by = span(whole(more.min()), whole(more.max()))
    return f"{text}; on the others it needs {by} more, from a gap μ₀ {times} times as large."


def _starts(cells: pd.DataFrame) -> Table:
    """Where each start lies over the ten loads, which explains the numbers of iterations."""
    scenes = [scene_of(active) for active in TABLE_2]
    of_loads = cells[cells["scene"].isin(scenes)]
    lines = []
    for start, name in STARTS.items():
        rows = records(ipm(of_loads, start=start))
        where = [figures_of(row, "start") for row in rows]
        line: dict[str, Any] = {"start": name, "loads": len(rows)}
        for what in ("mu", "infeasibility_mm", "corrections", "multiplications"):
            values = [float(w[what]) for w in where if as_number(w.get(what)) is not None]
            line |= {f"{what}_least": min(values, default=None), f"{what}_most": max(values, default=None)}
        iterations = [r["iterations"] for r in rows if r["verdict"] in ANSWERED]
        line |= {"iterations_least": min(iterations, default=None)}
        line |= {"iterations_most": max(iterations, default=None)}
        lines.append(line)
    columns = [
        word("start", "start"),
        number("loads", "loads", whole),
        Column("μ₀, N·mm", _range("mu", power)),
        Column("infeasibility, mm", _range("infeasibility_mm", power)),
        Column("row corrections", _range("corrections", whole)),
        Column("multiplications", _range("multiplications", whole)),
        Column("iterations", _range("iterations", whole)),
    ]
    caption = (
        "*Where the starts lie*, the range over the ten loads: the gap μ₀ that the iteration has to reduce, "
        "and the violation of y = Qλ − p."
    )
    return Table("paper-starts", caption, pd.DataFrame(lines), columns)


def _range(name: str, style: Callable[[object], str]) -> Callable[[Mapping[str, Any]], str]:
    def text(row: Mapping[str, Any]) -> str:
        return span(style(row[f"{name}_least"]), style(row[f"{name}_most"]))

    return text
