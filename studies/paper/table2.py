"""Table 2: the starting points on the ten loads."""

from __future__ import annotations

from report.document.blocks import Section
from report.document.numbers import MISSING, significant, whole

from .lines import table
from .printed import TABLE_2
from .rows import Row, Study

STARTS = {"stp1": "STP1", "stp2": "STP2", "algorithm_5": "Algorithm 5", "mehrotra": "Mehrotra"}
RIVALS = ("stp1", "stp2")
N = 4386


def loads(study: Study) -> dict[int, dict[str, Row]]:
    """By printed number of active contacts: the row of each start that was measured."""
    of_start = {start: study.ipm(start=start) for start in STARTS}
    return {
        active: {start: rows[scene] for start, rows in of_start.items() if scene in rows}
        for active in TABLE_2
        for scene in (f"{N}/{active:04d}",)
    }


def iterations(row: Row | None) -> int | None:
    """None without an answer."""
    return int(row["iterations"]) if row and row["verdict"] != "no_answer" else None


def section(study: Study) -> Section | None:
    found = loads(study)
    if not any(rival in rows for rows in found.values() for rival in RIVALS):
        return None
    lines = []
    for active, rows in found.items():
        line: Row = {"active, printed": active}
        line["ours"] = max((row["active"] for row in rows.values()), default=None)
        for start, name in STARTS.items():
            row, (its, seconds) = rows.get(start), TABLE_2[active].get(start, (None, None))
            line[f"{name}: iterations"] = _beside(whole(iterations(row)), whole(its))
            line[f"{name}: s"] = _beside(row["shown"] if row else MISSING, significant(seconds))
        lines.append(line)
    about = (
        "*The starting points on the ten loads, ours | printed*: iterations, and seconds per load case, the "
        "printed ones on the paper's machine. The paper does not state its ε_μ. STP1 and STP2 are as read "
        "from a secondary source; Mehrotra's start is not in the paper."
    )
    return Section("Table 2: starting points", [table("table2", about, lines, keys=2)])


def _beside(ours: str, printed: str) -> str:
    return ours if printed == MISSING else f"{ours} | {printed}"
