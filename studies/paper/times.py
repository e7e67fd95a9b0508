"""What the rows say of a claim, and how two times are compared.

The time of a stopped run is a lower bound, and decides only what a lower bound can decide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from report.analysis.standings import TIE
from report.document.numbers import significant

from .rows import ByScene, Row

#: For each case (a scene, a size, a form …) whether the claim holds there, None if the rows leave that open,
#: and the figures that decide it.
Evidence = Iterator[tuple[str, bool | None, str]]


def pairs(a: ByScene, b: ByScene) -> list[tuple[Row, Row]]:
    """Rows on the same scenes, both with a time or a lower bound of it."""
    pairs = [(a[scene], b[scene]) for scene in a if scene in b]
    return [(mine, other) for mine, other in pairs if mine["at_least"] and other["at_least"]]


def clearly_faster(a: Row, b: Row) -> bool | None:
    """None if they take about as long, or a lower bound leaves it open."""
    if TIE * a["at_least"] < b["at_least"]:
        return None if a["cut"] else True
    if TIE * b["at_least"] < a["at_least"]:
        return None if b["cut"] else False
    return None


def merged(rows: Iterable[Row], how: Callable[[list[float]], float]) -> Row:
    """The seconds of several rows as one."""
    rows = list(rows)
    return {"at_least": how([row["at_least"] for row in rows]), "cut": any(row["cut"] for row in rows)}


def against(mine: Row, other: Row) -> str:
    a, b = (f"{'> ' * row['cut']}{significant(row['at_least'])}" for row in (mine, other))
    return f"{a} against {b} s"
